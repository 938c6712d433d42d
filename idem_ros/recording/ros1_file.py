"""A ROS 1 bag by its index, or where that is missing or damaged, chunk after chunk."""

import io
from collections import Counter
from functools import partial

from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import Header, RecordType, normalize
from rosbags.typesys.msg import normalize_msgtype

from idem_ros.recording.inflating import Damaged, TooLarge, inflated
from idem_ros.recording.part import (
    MAX_CHUNK,
    NEVER,
    Block,
    Channel,
    ClippedFile,
    Logged,
    in_log_order,
)

MAGIC = b'#ROSBAG V2.0\n'


class Ros1File:
    """The messages of a ROS 1 bag; see `McapFile` for arguments and attributes.

    Raises:
        Damaged: it is no ROS 1 bag.
    """

    def __init__(self, path, max_chunk=MAX_CHUNK):
        self.path = path
        self.damage, self.left_out = '', []
        self.bytes_read = 0
        self.counts = Counter()
        self._max_chunk = max_chunk
        self._bad = set()
        self._by_id, self._blocks = {}, []
        self._stream = ClippedFile(path)
        try:
            if self._stream.read(len(MAGIC)) != MAGIC:
                size = self._stream.size
                raise Damaged('its magic is not that of a ROS 1 bag' if size else 'it is empty')
            if not self._index():
                self._scan()
        except BaseException:
            self.close()
            raise
        self.begin = min((block.begin for block in self._blocks), default=NEVER)

    @property
    def channels(self):
        """[`Channel`] in the order of the file."""
        return list(self._by_id.values())

    def close(self):
        """Close the file."""
        self._stream.close()

    def messages(self, channels):
        """Yield the `Logged` of some channels in log order."""
        ids = {id_ for id_, channel in self._by_id.items() if channel in channels}
        blocks = [block for block in self._blocks if block.channels & ids]
        yield from in_log_order(blocks, partial(self._read, ids=ids))

    def _index(self):
        """Take connections, counts and chunks from the index; return whether it can be read."""
        try:
            with Reader(self.path) as reader:
                for each in reader.connections:
                    form, text = ('ros1msg', each.msgdef.data)
                    self._by_id[each.id] = Channel(each.topic, each.msgtype, 'ros1', form, text)
                for chunk in {each.pos: each for each in reader.chunk_infos}.values():
                    if ids := frozenset(chunk.connection_counts) & set(self._by_id):
                        span = chunk.start_time, chunk.end_time
                        self._blocks.append(Block(*span, chunk.pos, frozenset(ids)))
                for id_, entries in reader.indexes.items():
                    self.counts[self._by_id[id_]] += len(entries)
        except Exception as error:  # damaged bytes raise anything, from struct.error to KeyError
            self.damage = _reason(error)
            self._by_id.clear()
            self._blocks.clear()
            self.counts.clear()
        return not self.damage

    def _scan(self):
        self._stream.seek(len(MAGIC))
        while True:
            at = self._stream.tell()
            try:
                header = Header.read(self._stream)
                size = int.from_bytes(self._stream.read(4), 'little')
                start = self._stream.tell()
            except Exception:  # see `_index`
                return
            if header.get('op') is None:
                return
            if header['op'][0] == RecordType.CHUNK:
                self._take(at)
            self._stream.seek(start + size)

    def _take(self, at):
        """Count the messages of a chunk, which may be cut off."""
        times, ids = [], set()
        try:
            for id_, log_time, _ in self._messages_in(self._content(at)):
                times.append(log_time)
                ids.add(id_)
                self.counts[self._by_id[id_]] += 1
        except Damaged:
            return  # it is named
        if times:
            self._blocks.append(Block(min(times), max(times), at, frozenset(ids)))
            self.bytes_read = self._stream.tell()

    def _read(self, block, ids):
        """Return the `Logged` of a block; none of one that is damaged, which is named."""
        if block.offset in self._bad:
            return []
        try:
            found = list(self._messages_in(self._content(block.offset)))
        except Damaged:
            return []
        return [Logged(time, self._by_id[id_], raw) for id_, time, raw in found if id_ in ids]

    def _content(self, at):
        """Return the records of a chunk; of the last one without compression it may be cut off."""
        try:
            self._stream.seek(at)
            header = Header.read(self._stream, RecordType.CHUNK)
            compression, declared = header.get_string('compression'), header.get_uint32('size')
            size = int.from_bytes(self._stream.read(4), 'little')
            if declared > self._max_chunk:
                raise TooLarge(
                    f'it declares {declared} bytes, more than --max-chunk {self._max_chunk}'
                )
            content = self._stream.read(size)
            if compression == 'none' and len(content) < size:
                return content
            return inflated(content, compression, declared, self._max_chunk)
        except Exception as error:  # see `_index`
            if at not in self._bad:
                self._bad.add(at)
                self.left_out.append(f'the chunk at byte {at}: {_reason(error)}')
            raise Damaged(_reason(error)) from error

    def _messages_in(self, content):
        """Yield (connection, log time, bytes) of records up to the first that is no whole one."""
        inner = io.BytesIO(content)
        while True:
            try:
                header = Header.read(inner)
                size = int.from_bytes(inner.read(4), 'little')
                raw = inner.read(size)
                if len(raw) != size or 'op' not in header:
                    return
                if header['op'][0] == RecordType.CONNECTION:
                    self._connect(header, raw)
                elif header['op'][0] == RecordType.MSGDATA and header['conn']:
                    id_ = header.get_uint32('conn')
                    if id_ in self._by_id:
                        yield id_, header.get_time('time'), raw
            except Exception:  # see `_index`
                return

    def _connect(self, header, raw):
        inner = Header.read(io.BytesIO(len(raw).to_bytes(4, 'little') + raw))
        self._by_id[header.get_uint32('conn')] = Channel(
            normalize(header.get_string('topic')),
            normalize_msgtype(inner.get_string('type')),
            'ros1',
            'ros1msg',
            inner.get_string('message_definition'),
        )


def _reason(error):
    return ' '.join(str(error).split()).rstrip('.') or type(error).__name__
