"""An MCAP by its index, or where that is missing or damaged, record after record."""

import io
import math
import struct
import zlib

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel as ChannelRecord
from mcap.records import Footer, Schema

from idem_ros.recording.chunked_file import ChunkedFile
from idem_ros.recording.definitions import normalized
from idem_ros.recording.embedded import MAGIC, ends_whole
from idem_ros.recording.inflating import Damaged, inflated
from idem_ros.recording.part import Block, Channel
from idem_ros.terminal.printable import error_line

RECORD = struct.Struct('<BQ')  # opcode, length
CHUNK = struct.Struct('<QQQII')  # begin, end, size, CRC, length of the compression's name
MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time
FOOTER = 37  # bytes from its opcode to the end of the file
ENCODED = {'ros1msg': 'ros1', 'ros2msg': 'cdr', 'ros2idl': 'cdr', 'omgidl': 'cdr'}
INDEX, ENTRY = 15, 16  # bytes of the index of a channel in a chunk, and of each of its messages


class McapFile(ChunkedFile):
    """The messages of an MCAP; a message by itself counts as a chunk."""

    magic, kind = MAGIC, 'an MCAP'

    def __init__(self, *args):
        self._schemas = {}
        super().__init__(*args)

    def _summary(self):
        """Return the summary; None where there is none, or none that can be believed."""
        if not ends_whole(self._stream):
            self.damage = 'its end is missing'
            return None
        try:
            self._stream.seek(0)
            limit = self._stream.size
            summary = SeekingReader(self._stream, record_size_limit=limit).get_summary()
            if summary is not None:
                self._require_crc()
        except Exception as error:  # damaged bytes raise anything: struct.error, KeyError
            self.damage = error_line(error)
            return None
        return summary

    def _index(self):
        """Take channels, counts and chunks from the summary; return whether it has them all."""
        summary = self._summary()
        if summary is None:
            return False
        self._schemas.update(summary.schemas)
        for record in summary.channels.values():
            self._add_channel(record)
        found, chunks = summary.statistics, summary.chunk_indexes
        if not found or len(chunks) != found.chunk_count or (found.message_count and not chunks):
            return False
        if _indexed(chunks) < found.message_count:
            return False  # some stand outside of chunks
        is_known = set(found.channel_message_counts) <= set(self._by_id)
        if not is_known or len({each.chunk_start_offset for each in chunks}) < len(chunks):
            return False
        for id_, count in found.channel_message_counts.items():
            self.counts[self._by_id[id_]] += count
        for each in chunks:
            ids = frozenset(each.message_index_offsets) or None
            span = each.message_start_time, each.message_end_time
            self._blocks.append(Block(*span, each.chunk_start_offset, ids))
        return True

    def _require_crc(self):
        self._stream.seek(-FOOTER, io.SEEK_END)
        tail = self._stream.read(FOOTER)
        footer = Footer.read(ReadDataStream(io.BytesIO(tail[RECORD.size :])))
        if footer.summary_crc:
            self._stream.seek(footer.summary_start)
            end = self._stream.size - FOOTER
            crc = zlib.crc32(self._stream.read(end - footer.summary_start))
            if zlib.crc32(tail[: FOOTER - 12], crc) != footer.summary_crc:
                raise Damaged('the checksum of its index is wrong')

    def _scan(self):
        """Find every chunk and message, up to the end or where the next cannot be told."""
        self._stream.seek(len(MAGIC))
        while len(head := self._stream.read(RECORD.size)) == RECORD.size:
            opcode, length = RECORD.unpack(head)
            offset = self._stream.tell() - RECORD.size
            end = offset + RECORD.size + length
            is_end = opcode in (Opcode.DATA_END, Opcode.FOOTER)
            if is_end or end > self._stream.size:
                if not is_end:
                    self.damage = self.damage or 'it ends within a record'
                break
            try:
                self._take(opcode, length, offset)
            except Damaged:
                pass  # a chunk, which is named
            except Exception as error:  # see `_index`
                self.damage = self.damage or error_line(error)
            self._stream.seek(end)
            self.bytes_read = end

    def _take(self, opcode, length, offset):
        if opcode == Opcode.MESSAGE:
            id_, _, log_time, _ = MESSAGE.unpack(self._stream.read(MESSAGE.size))
            if id_ in self._by_id:
                self.counts[self._by_id[id_]] += 1
                self._blocks.append(Block(log_time, log_time, offset, frozenset({id_})))
        elif opcode == Opcode.CHUNK:
            self._take_chunk(offset)
        else:
            self._definition(opcode, self._stream.read(length))

    def _definition(self, opcode, content):
        stream = ReadDataStream(io.BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            self._add_channel(ChannelRecord.read(stream))

    def _add_channel(self, record):
        schema = self._schemas.get(record.schema_id)
        form = schema.encoding if schema else ''
        name = schema.name if schema else ''
        # an encoding that is not said is that of the definition
        encoding = record.message_encoding or ENCODED.get(form, '')
        is_ros = encoding in ENCODED.values()
        definition = schema.data.decode('utf-8', 'replace') if schema and is_ros else ''
        name = normalized(name) if is_ros else name
        self._by_id[record.id] = Channel(record.topic, name, encoding, form, definition)

    def _checked(self, offset):
        """Return the records of a chunk, or a message by itself."""
        self._stream.seek(offset)
        head = self._stream.read(RECORD.size)
        opcode, length = RECORD.unpack(head)
        if opcode == Opcode.MESSAGE:
            return memoryview(head + self._stream.read(length))
        if opcode != Opcode.CHUNK:
            raise Damaged('there is none')
        _, _, size, crc, name = CHUNK.unpack(self._stream.read(CHUNK.size))
        compression = self._stream.read(name).decode('ascii', 'replace')
        (compressed,) = struct.unpack('<Q', self._stream.read(8))
        self._require_small(size)
        content = inflated(self._stream.read(compressed), compression, size, self._max_chunk)
        if crc and zlib.crc32(content) != crc:
            raise Damaged('its checksum is wrong')
        return memoryview(content)

    def _messages_in(self, content):
        """Yield (channel's number, log time, bytes) of records; take in schemas and channels."""
        at = 0
        while at + RECORD.size <= len(content):
            opcode, length = RECORD.unpack_from(content, at)
            at += RECORD.size
            record = content[at : at + length]
            at += length
            if opcode == Opcode.MESSAGE:
                id_, _, log_time, _ = MESSAGE.unpack_from(record)
                yield id_, log_time, record[MESSAGE.size :]
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._definition(opcode, bytes(record))


def _indexed(chunks):
    """Return how many messages stand in chunks, as far as that is known without reading them."""
    if not all(each.message_index_offsets for each in chunks):
        return math.inf
    of_channels = ((each.message_index_length, len(each.message_index_offsets)) for each in chunks)
    return sum((size - INDEX * count) // ENTRY for size, count in of_channels)
