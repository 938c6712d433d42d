"""Read recordings of ROS 1 and ROS 2 lazily, without ROS."""

import heapq
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rosbags.highlevel import AnyReader

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.messages import typestore
from idem_ros.recording.salvage import SalvagedMcap

SUFFIXES = ('.mcap', '.db3', '.bag')


class UnreadableRecording(IdemError):
    """A recording of which nothing can be read."""


@dataclass(frozen=True)
class Topic:
    """What a recording holds on one topic."""

    msgtype: str
    count: int


@dataclass(frozen=True)
class Recording:
    """An open recording.

    Attributes:
        path: as given.
        topics: {name: `Topic`}, in order of name.
        warnings: what could not be read, one sentence each; `messages` may add to it.
        begin: log time of the first message [ns].
    """

    path: Path
    topics: dict[str, Topic]
    warnings: list[str] = field(default_factory=list)
    begin: int = 0
    _parts: tuple = ()

    def messages(self, topics):
        """Yield (topic, log time [ns], message) of some topics, in log order, one at a time.

        Args:
            topics: names, as in `self.topics`.
        """
        streams = [_until_damaged(part, set(topics), self) for part in self._parts]
        yield from heapq.merge(*streams, key=lambda logged: logged[1])


@contextmanager
def open_recording(path):
    """Open a bare MCAP or db3, a rosbag2 folder (with metadata.yaml or without) or a ROS 1 bag.

    An MCAP that is cut off is read as far as it goes; `Recording.warnings` then says how far.

    Args:
        path: file or folder.

    Yields:
        `Recording`

    Raises:
        UnreadableRecording: there is no such file, it is no recording, or nothing can be read.
    """
    path = Path(path)
    files = recording_files(path)
    warnings = []
    with ExitStack() as stack:
        try:
            parts = [stack.enter_context(_opened(path))]
        except Exception as error:  # damaged bytes raise anything, from struct.error to KeyError
            # a folder without metadata.yaml, or with one damaged file, opens file by file
            parts = [_open_file(stack, file, error, warnings) for file in files]
        begin = min(part.begin for part in parts)
        yield Recording(path, _topics(parts), warnings, begin, tuple(parts))


def recording_files(path):
    """Return the files of a recording: itself, or those of its folder, by name.

    Raises:
        UnreadableRecording: there is none.
    """
    if not path.exists():
        raise UnreadableRecording(f'{path} does not exist; give a recording ({_suffixes()})')
    if path.is_file():
        if path.suffix not in SUFFIXES:
            raise UnreadableRecording(f'{path} is no recording: its suffix must be {_suffixes()}')
        return [path]
    files = sorted(file for suffix in SUFFIXES for file in path.glob(f'*{suffix}'))
    if not files:
        raise UnreadableRecording(f'the folder {path} holds no recording ({_suffixes()})')
    return files


def _suffixes():
    return ', '.join(SUFFIXES)


class _IntactPart:
    """What rosbags reads, with the interface of `SalvagedMcap`."""

    def __init__(self, reader):
        self._reader = reader
        self.msgtypes = {name: topic.msgtype or '' for name, topic in reader.topics.items()}
        self.counts = {name: topic.msgcount for name, topic in reader.topics.items()}
        self.begin = reader.start_time

    def messages(self, topics):
        connections = [c for c in self._reader.connections if c.topic in topics]
        if not connections:  # rosbags takes an empty list for "all"
            return
        for connection, log_time, raw in self._reader.messages(connections):
            yield connection.topic, log_time, self._reader.deserialize(raw, connection.msgtype)


@contextmanager
def _opened(path):
    with AnyReader([path], default_typestore=typestore()) as reader:
        yield _IntactPart(reader)


def _open_file(stack, file, error, warnings):
    try:
        return stack.enter_context(_opened(file))
    except Exception as own_error:
        error = own_error
    salvaged = SalvagedMcap(file) if file.suffix == '.mcap' else None
    if not (salvaged and salvaged.counts):
        raise UnreadableRecording(f'{file} cannot be read: {_reason(error)}') from error
    size = file.stat().st_size
    warnings.append(
        f'{file} is cut off or damaged ({_reason(error)}): '
        f'{salvaged.counts.total()} messages can be read, '
        f'from {salvaged.bytes_read} of its {size} bytes'
    )
    return salvaged


def _topics(parts):
    topics = {}
    for part in parts:
        for name, msgtype in part.msgtypes.items():
            before = topics[name].count if name in topics else 0
            topics[name] = Topic(msgtype, before + part.counts[name])
    return dict(sorted(topics.items()))


def _until_damaged(part, topics, recording):
    count = 0
    try:
        for logged in part.messages(topics):
            yield logged
            count += 1
    except Exception as error:  # see open_recording
        recording.warnings.append(
            f'{recording.path} is damaged after {count} messages, the rest is left out: '
            f'{_reason(error)}'
        )


def _reason(error):
    return ' '.join(str(error).split()) or type(error).__name__
