"""A ROS 1 bag by its index, or where that is missing or damaged, chunk after chunk."""

import io
from contextlib import suppress

from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import Header, RecordType, normalize
from rosbags.typesys.msg import normalize_msgtype

from idem_ros.recording.chunked_file import ChunkedFile
from idem_ros.recording.inflating import Damaged, inflated
from idem_ros.recording.part import Block, Channel
from idem_ros.terminal.printable import error_line


class Ros1File(ChunkedFile):
    """The messages of a ROS 1 bag."""

    magic, kind = b'#ROSBAG V2.0\n', 'a ROS 1 bag'

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
            self.damage = error_line(error)
            self._by_id.clear()
            self._blocks.clear()
            self.counts.clear()
        return not self.damage

    def _scan(self):
        self.bytes_read = 0
        self._stream.seek(len(self.magic))
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
                with suppress(Damaged):  # it is named
                    if self._take_chunk(at):
                        self.bytes_read = self._stream.tell()
            self._stream.seek(start + size)

    def _checked(self, at):
        """Return the records of a chunk; of the last one without compression it may be cut off."""
        self._stream.seek(at)
        header = Header.read(self._stream, RecordType.CHUNK)
        compression, declared = header.get_string('compression'), header.get_uint32('size')
        size = int.from_bytes(self._stream.read(4), 'little')
        self._require_small(declared)
        content = self._stream.read(size)
        if compression == 'none' and len(content) < size:
            return content
        return inflated(content, compression, declared, self._max_chunk)

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
