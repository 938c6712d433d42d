"""Read what is left of a damaged recording: the recorder crashed, a copy was cut short."""

from collections import Counter
from typing import NamedTuple

from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from idem_ros.recording.salvage_ros1 import ros1_messages

NEVER = 2**63 - 1  # [ns]; as rosbags has it for an empty recording


class Logged(NamedTuple):
    """A message as it lies in a recording."""

    topic: str
    msgtype: str
    definition: str
    """Of the type and all that it uses, as text."""
    log_time: int
    raw: bytes
    position: int
    """How far the file was read for it."""


def mcap_messages(path):
    """Yield the `Logged` messages of an MCAP, None for each chunk that is damaged."""
    with path.open('rb') as stream:
        schemas, channels = _at_the_end(stream)
        stream.seek(0)
        for record in _whole(StreamReader(stream, emit_chunks=True).records):
            inner = _records_of(record)
            if inner is None:
                yield None
                continue
            for each in inner:
                if isinstance(each, Schema):
                    schemas[each.id] = each
                elif isinstance(each, Channel):
                    channels[each.id] = each
                elif isinstance(each, Message):
                    channel = channels.get(each.channel_id)
                    schema = channel and schemas.get(channel.schema_id)
                    if schema and schema.encoding == 'ros2msg':
                        definition = schema.data.decode()
                        found = channel.topic, schema.name, definition, each.log_time, each.data
                        yield Logged(*found, stream.tell())


FORMATS = {
    '.mcap': (mcap_messages, 'deserialize_cdr'),
    '.bag': (lambda path: ros1_messages(path, Logged), 'deserialize_ros1'),
}


class Salvaged:
    """The messages of a damaged recording that can be read, in the order of the file.

    Args:
        path: with a suffix among `FORMATS`.

    Attributes:
        msgtypes: {topic: type} of what was found.
        counts: {topic: messages that can be read}.
        begin: the earliest log time among them [ns].
        bytes_read: how far the file could be read.
        chunks_left_out: how many chunks before that are damaged.
    """

    def __init__(self, path):
        self.path = path
        self._logged, deserialize = FORMATS[path.suffix]
        self.msgtypes = {}
        self.counts = Counter()
        self.bytes_read = self.chunks_left_out = 0
        self.begin = NEVER
        typestore = get_typestore(Stores.EMPTY)
        self._deserialize = getattr(typestore, deserialize)
        for logged in self._logged(path):
            if logged is None:
                self.chunks_left_out += 1
                continue
            if logged.topic not in self.msgtypes:
                self.msgtypes[logged.topic] = logged.msgtype
                typestore.register(get_types_from_msg(logged.definition, logged.msgtype))
            self.counts[logged.topic] += 1
            self.bytes_read = logged.position
            self.begin = min(self.begin, logged.log_time)

    def messages(self, topics, after=-1):
        """Yield (topic, log time [ns], message) of some topics, logged after a time."""
        for logged in self._logged(self.path):
            if logged and logged.topic in topics and logged.log_time > after:
                message = self._deserialize(logged.raw, logged.msgtype)
                yield logged.topic, logged.log_time, message


def _at_the_end(stream):
    """Return the schemas and channels of the summary: a damaged chunk may hide the others."""
    try:
        summary = SeekingReader(stream).get_summary()
        return dict(summary.schemas), dict(summary.channels)
    except Exception:  # it is cut off; and see `_whole`
        return {}, {}


def _whole(records):
    """Yield records up to the first that cannot be told from the next."""
    try:
        yield from records
    except Exception:  # damaged bytes raise anything: struct.error, UnicodeDecodeError
        return


def _records_of(record):
    """Return the records of a chunk, or any other record alone; None: it is damaged."""
    if not isinstance(record, Chunk):
        return [record]
    try:
        return breakup_chunk(record, validate_crc=True)
    except Exception:  # see `_whole`; and ZstdError
        return None
