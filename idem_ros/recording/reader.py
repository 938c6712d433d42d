"""Read recordings of ROS 1 and ROS 2 lazily, without ROS."""

import heapq
import re
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from rosbags.highlevel import AnyReader

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.messages import typestore
from idem_ros.recording.salvage import FORMATS, Salvaged

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

    An MCAP or ROS 1 bag that is cut off or has no index is read as far as it goes, and damaged
    chunks are passed over; `Recording.warnings` then says how much was read.

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
            parts = _open_each(stack, files, error, warnings)
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
    """What rosbags reads, with the interface of `Salvaged`."""

    def __init__(self, path, reader):
        self.path = path
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
        yield _IntactPart(path, reader)


def _open_each(stack, files, error, warnings):
    """Open what can be opened; the rest is a warning, unless it is all."""
    parts, refused = [], []
    for file in files:
        try:
            parts.append(_open_file(stack, file, error, warnings))
        except UnreadableRecording as own_error:
            refused.append(own_error)
    if not parts:
        raise refused[0]
    warnings.extend(str(each) for each in refused)
    return parts


def _open_file(stack, file, error, warnings):
    try:
        return stack.enter_context(_opened(file))
    except Exception as own_error:
        error = own_error
    salvaged = Salvaged(file) if file.suffix in FORMATS else None
    size = file.stat().st_size
    if salvaged and salvaged.counts:
        warnings.append(
            f'{file} is cut off or damaged ({_reason(error)}): '
            f'{salvaged.counts.total()} messages can be read, '
            f'from {salvaged.bytes_read} of its {size} bytes{_left_out([salvaged])}'
        )
        return salvaged
    of_it = f', and none of its {size} bytes make a message' if salvaged and size else ''
    raise UnreadableRecording(f'{file} cannot be read: {_reason(error)}{of_it}') from error


def _topics(parts):
    topics = {}
    for part in parts:
        for name, msgtype in part.msgtypes.items():
            before = topics[name].count if name in topics else 0
            topics[name] = Topic(msgtype, before + part.counts[name])
    return dict(sorted(topics.items()))


def _until_damaged(part, topics, recording):
    """Yield the messages of a part; where it is damaged, go on with what can be read after it."""
    total = sum(part.counts[topic] for topic in topics if topic in part.counts)
    count, last = 0, -1
    try:
        for logged in part.messages(topics):
            yield logged
            count += 1
            last = logged[1]
    except Exception as error:  # see open_recording
        reason = _reason(error)
    else:
        if count < total:  # rosbags skips topics whose QoS is another in metadata.yaml
            recording.warnings.append(
                f'{part.path}: only {count} of the {total} messages it should have were found; '
                'is its metadata.yaml of another recording?'
            )
        return
    salvaged = [Salvaged(file) for file in recording_files(part.path) if file.suffix in FORMATS]
    for logged in _after(salvaged, topics, last):
        yield logged
        count += 1
    recording.warnings.append(
        f'{part.path} is damaged ({reason}): {count} of {total} messages can be read'
        f'{_left_out(salvaged)}'
    )


def _after(salvaged, topics, last):
    with suppress(Exception):  # see open_recording; what cannot be read even so ends it
        for each in salvaged:
            yield from each.messages(topics, after=last)


def _left_out(salvaged):
    chunks = sum(each.chunks_left_out for each in salvaged)
    return f'; chunks left out: {chunks}' if chunks else ''


def _reason(error):
    """Return what rosbags says in one line, without the file's name, which stands before it."""
    reason = ' '.join(str(error).split()).rstrip('.')
    reason = re.sub(r'^(Cannot|Could not) open (file|database) .*?(: | or (?=data))', '', reason)
    return re.sub(r"^File '.*?' (?=seems)", 'it ', reason) or type(error).__name__
