"""Read recordings of ROS 1 and ROS 2 lazily, without ROS."""

import heapq
from collections import Counter
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.decoding import UnreadableTopic, decoder
from idem_ros.recording.folder import UnreadableRecording, bare_name, contents_of
from idem_ros.recording.inflating import Damaged, TooLarge, compression_of, inflated_file
from idem_ros.recording.mcap_file import McapFile
from idem_ros.recording.part import MAX_CHUNK, NEVER
from idem_ros.recording.ros1_file import Ros1File
from idem_ros.recording.sqlite_file import SqliteFile
from idem_ros.terminal.printable import error_line

SHOWN = 3  # chunks of a file that are named one by one
FORMATS = {'.mcap': McapFile, '.db3': SqliteFile, '.bag': Ros1File}
LONGEST_MAGIC = max(len(each.magic) for each in FORMATS.values())


@dataclass(frozen=True)
class Topic:
    """What a recording holds on one topic."""

    msgtype: str
    """With the encoding, where that is none of ROS: 'foxglove.Log (json)'."""
    count: int


@dataclass(frozen=True)
class Recording:
    """An open recording.

    Attributes:
        path: as given.
        topics: {name: `Topic`}, in order of name.
        warnings: what could not be read, one sentence each; `messages` may add to it.
        begin: log time of the first message [ns].
        lost: {one of `part.LOSSES`: how many}; `messages` may add to it.
    """

    path: Path
    topics: dict[str, Topic]
    warnings: list[str] = field(default_factory=list)
    begin: int = 0
    lost: Counter = field(default_factory=Counter)
    _parts: tuple = ()
    _max_chunk: int = MAX_CHUNK

    def require_readable(self, topic):
        """Refuse a topic whose messages cannot be read.

        Raises:
            UnreadableTopic: of another encoding, or of a type that the standard has otherwise.
        """
        for part in self._parts:
            for channel in _channels(part, {topic}):
                try:
                    decoder(channel, self._max_chunk)
                except UnreadableTopic as error:
                    raise UnreadableTopic(f'{part.path}: {error}') from error

    def messages(self, topics):
        """Yield (topic, log time [ns], message) of some topics, in log order, one at a time.

        Types of other topics are not looked at. A message that cannot be decoded is left out and
        counted.

        Args:
            topics: names, as in `self.topics`.

        Raises:
            UnreadableTopic: see `require_readable`.
        """
        topics = {topic for topic in topics if topic in self.topics}
        for topic in sorted(topics):
            self.require_readable(topic)
        streams = [_decoded(part, topics, self) for part in self._parts]
        yield from heapq.merge(*streams, key=lambda logged: logged[1])


@contextmanager
def open_recording(path, max_chunk=MAX_CHUNK):
    """Open a bare MCAP or db3, a rosbag2 folder (with metadata.yaml or without) or a ROS 1 bag.

    Any of these may be compressed by zstd, as a file (it is inflated into the folder of temporary
    files) or message by message. What is cut off, damaged, without index or not there is passed
    over: `Recording.warnings` names it, `Recording.lost` counts it.

    Args:
        path: file or folder.
        max_chunk: chunks that declare to inflate to more are left out [bytes].

    Yields:
        `Recording`

    Raises:
        UnreadableRecording: there is no such file, it is no recording, or nothing can be read.
    """
    path = Path(path)
    contents = contents_of(path)
    warnings, lost = [], Counter()
    with ExitStack() as stack:
        parts, refused = [], []
        for file in contents.files:
            try:
                parts.append(_opened(stack, file, max_chunk, warnings, lost))
            except UnreadableRecording as error:
                refused.append(error)
        if not parts:
            raise refused[0]
        lost['files_unreadable'] += len(refused)
        warnings.extend(str(error) for error in refused)
        warnings.extend(_of_folder(path, contents, parts, lost))
        begin = min((part.begin for part in parts), default=NEVER)
        yield Recording(path, _topics(parts), warnings, begin, lost, tuple(parts), max_chunk)


def _opened(stack, file, max_chunk, warnings, lost):
    """Open a file; what of it is damaged is a warning."""
    inner = file
    try:
        if compression := compression_of(_head(file)):
            inner = stack.enter_context(inflated_file(file, compression, max_chunk))
        part = stack.enter_context(closing(_part(inner, max_chunk)))
    except (Damaged, TooLarge, OSError) as error:
        reason = getattr(error, 'strerror', None) or _one_line(error).rstrip('.')
        raise UnreadableRecording(f'{file} cannot be read: {reason}') from error
    part.path = file
    size, total = inner.stat().st_size, sum(part.counts.values())
    if part.damage and not total:
        raise UnreadableRecording(
            f'{file} cannot be read: {part.damage}, and none of its {size} bytes make a message'
        )
    lost['files_damaged'] += bool(part.damage)
    lost['chunks_left_out'] += len(part.left_out)
    if part.damage or part.left_out:
        why = f' is cut off or damaged ({part.damage})' if part.damage else ''
        warnings.append(
            f'{file}{why}: {total} messages can be read, from {part.bytes_read} of its {size} '
            f'bytes{_left_out(part.left_out)}'
        )
    return part


def _part(file, max_chunk):
    """Open a file as what it begins like, be it named otherwise; else as what its name says."""
    head = _head(file)
    if not head:
        raise Damaged('it is empty')
    found = [each for each in FORMATS.values() if head.startswith(each.magic)]
    of_name = FORMATS[Path(bare_name(file.name)).suffix]
    return (found or [of_name])[0](file, max_chunk)


def _head(file):
    with file.open('rb') as stream:
        return stream.read(LONGEST_MAGIC)


def _of_folder(path, contents, parts, lost):
    """Yield what a folder lacks of what its metadata.yaml says, and what it has beside that."""
    if contents.damage:
        yield f'{contents.damage}; the files of the folder are read by their names'
    found = sum(sum(part.counts.values()) for part in parts)
    total = contents.messages
    for name, count in contents.missing:
        if count is None and len(contents.missing) == 1 and total is not None:
            count = max(total - found, 0)
        of_them = '' if count is None else f' ({count} of {total} messages)'
        yield f'{path / name} is missing, which metadata.yaml names{of_them}'
    lost['files_missing'] += len(contents.missing)
    read = {part.path.name for part in parts}
    for name in filter(read.__contains__, contents.extra):
        yield f'{path / name} is not named in metadata.yaml; it is read, too'
    for name in contents.left_out:
        yield f'{path / name} is not named in metadata.yaml; it is left out'
    lost['files_extra'] += len(contents.extra) + len(contents.left_out)
    is_explained = contents.missing or contents.extra or len(parts) < len(contents.files)
    if total is not None and total != found and not (is_explained or lost['files_damaged']):
        yield f'{path}: metadata.yaml tells of {total} messages, its files hold {found}'


def _channels(part, topics):
    """Return the channels of some topics; of a topic with several, those of ROS."""
    found = [channel for channel in part.channels if channel.topic in topics]
    readable = {channel.topic for channel in found if channel.is_ros}
    return [each for each in found if each.is_ros or each.topic not in readable]


def _topics(parts):
    kinds, counts = {}, Counter()
    for part in parts:
        for channel in _channels(part, {each.topic for each in part.channels}):
            kinds.setdefault(channel.topic, {})[channel.kind] = None
            counts[channel.topic] += part.counts[channel]
    return {name: Topic(' or '.join(kinds[name]), counts[name]) for name in sorted(kinds)}


def _decoded(part, topics, recording):
    """Yield the messages of a part; what of it cannot be read is counted and named."""
    channels = list(dict.fromkeys(_channels(part, topics)))
    if not channels:
        return
    decoders = {channel: decoder(channel, recording._max_chunk) for channel in channels}
    total, count, reason = sum(part.counts[channel] for channel in channels), 0, ''
    before = len(part.left_out)
    try:
        for log_time, channel, raw in part.messages(channels):
            try:
                message = decoders[channel](raw)
            except Exception as error:  # rosbags raises anything of bytes that are none
                reason = reason or f'{channel.topic} at {log_time}: {_one_line(error)}'
                continue
            yield channel.topic, log_time, message
            count += 1
    except IdemError as error:
        reason = _one_line(error)
    left_out = part.left_out[before:]
    recording.lost['chunks_left_out'] += len(left_out)
    if count < total or left_out:
        recording.lost['messages_left_out'] += max(total - count, 0)
        why = f' ({reason})' if reason else ''
        recording.warnings.append(
            f'{part.path}: {count} of {total} messages can be read{why}{_left_out(left_out)}'
        )


def _left_out(reasons):
    if not reasons:
        return ''
    more = f' and {len(reasons) - SHOWN} others' if len(reasons) > SHOWN else ''
    return f'; chunks left out: {len(reasons)} ({"; ".join(reasons[:SHOWN])}{more})'


def _one_line(error):
    return error_line(error)[:200]
