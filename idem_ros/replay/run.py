"""Do what settings ask for: refine pairs, or follow a sequence of scans."""

from idem_ros.core.exceptions import IdemError
from idem_ros.replay.pairs import replay_each, silent
from idem_ros.replay.sequence import odometry_each


class UselessTopic(IdemError):
    """A topic that is named for a role which what is asked for does not have."""


def run_each(path, settings, *, progress=silent, **topics):
    """Replay a recording by one or several `Settings`, see `replay_each` and `odometry_each`.

    Raises:
        UselessTopic: a target or a guess is named, and odometry has neither.
    """
    if settings[0].sequence is None:
        return replay_each(path, settings, progress=progress, **topics)
    for role in ('target', 'guess', 'tf'):
        if useless := topics.pop(f'{role}_topic', None):
            name = useless if isinstance(useless, str) else ', '.join(useless)
            raise UselessTopic(
                f'{name} is named, but a sequence has neither target nor guess: '
                '--source-topic names the scans, --truth-topic the true poses'
            )
    return odometry_each(path, settings, progress=progress, **topics)
