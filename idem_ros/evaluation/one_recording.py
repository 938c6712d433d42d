"""One of many recordings, from its file to what is known of it: run wherever a worker runs."""

from dataclasses import dataclass

from idem_ros.core.exceptions import IdemError
from idem_ros.replay.settings import Settings


@dataclass(frozen=True)
class Task:
    """A recording to be evaluated; small, for it is sent to workers."""

    path: str
    settings: Settings
    topics: dict[str, str | None]
    """As `replay_each` takes them: {'target_topic': name or None, ...}."""
    done: frozenset[str] = frozenset()
    """`identity` of the recordings whose results are there already."""


@dataclass(frozen=True)
class Outcome:
    """What became of a task."""

    path: str
    text: str | None = None
    """The JSON that `idem replay --json` writes; None: there is none, or there was one before."""
    reason: str = ''
    """Why it could not be evaluated; empty: it was."""
    identity: str = ''
    """Of the recording, where it was evaluated."""


def evaluated(task, progress=lambda messages, total: messages):
    """Replay a recording, unless its result is there already.

    Args:
        task: `Task`.
        progress: see `replay_each`.

    Returns:
        `Outcome`; what is wrong with a recording is in it, not raised.
    """
    from idem_ros.recording.folder import fingerprint
    from idem_ros.replay.provenance import made_by, map_fingerprint
    from idem_ros.replay.run import replay_each
    from idem_ros.results.result_file import record_text
    from idem_ros.results.summary import json_record, why_nothing

    try:
        input_ = fingerprint(task.path)
        key = identity(input_)
        if key in task.done:
            return Outcome(task.path, identity=key)
        map_ = map_fingerprint(task.settings.map.target_file)
        (replayed,) = replay_each(task.path, [task.settings], progress=progress, **task.topics)
    except (IdemError, OSError) as error:
        return Outcome(task.path, reason=str(error))
    if replayed.interrupted:
        return Outcome(task.path, reason='interrupted before it was done')
    if not replayed.frames:
        return Outcome(task.path, reason=why_nothing(replayed))
    record = json_record(replayed, made_by(task.settings, replayed.topics, input_, map_))
    return Outcome(task.path, ''.join(record_text(record)), identity=key)


def identity(input_):
    """Return what tells a recording from all others, of its `fingerprint`, as one text."""
    return f'{input_["name"]} {input_["size"]} {input_["sha256"]}'
