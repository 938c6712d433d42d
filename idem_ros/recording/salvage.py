"""Read what is left of an MCAP without its end: a recorder that crashed, a copy cut short."""

from collections import Counter

from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


class SalvagedMcap:
    """The messages of an MCAP from its beginning to the first record that cannot be read.

    Attributes:
        msgtypes: {topic: type} of what was found.
        counts: {topic: messages that can be read}.
        bytes_read: how far the file could be read.
        begin: log time of the first message [ns].
    """

    def __init__(self, path):
        self._path = path
        self.msgtypes = {}
        self.counts = Counter()
        self.bytes_read = 0
        self._typestore = get_typestore(Stores.EMPTY)
        self.begin = 0
        for schema, channel, message, position in self._records():
            self.begin = self.begin if self.counts else message.log_time
            if channel.topic not in self.msgtypes:
                self.msgtypes[channel.topic] = schema.name
                self._typestore.register(get_types_from_msg(schema.data.decode(), schema.name))
            self.counts[channel.topic] += 1
            self.bytes_read = position

    def messages(self, topics):
        """Yield (topic, log time [ns], message) of some topics, in the order of the file."""
        for schema, channel, message, _ in self._records():
            if channel.topic in topics:
                yield (
                    channel.topic,
                    message.log_time,
                    self._typestore.deserialize_cdr(message.data, schema.name),
                )

    def _records(self):
        schemas, channels = {}, {}
        with self._path.open('rb') as stream:
            records = StreamReader(stream, validate_crcs=True).records
            while (record := _next_intact(records)) is not None:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels.get(record.channel_id)
                    schema = channel and schemas.get(channel.schema_id)
                    if schema and schema.encoding == 'ros2msg':
                        yield schema, channel, record, stream.tell()


def _next_intact(records):
    try:
        return next(records, None)
    except Exception:  # damaged bytes raise anything: struct.error, UnicodeDecodeError, ZstdError
        return None
