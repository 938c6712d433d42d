"""Write a bare MCAP that rosbag2, Foxglove and rosbags open, the same bytes every time."""

import struct
from functools import cache
from itertools import chain

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from idem_ros.files.atomic_file import replacing
from idem_ros.recording.embedded import MAGIC, piece_name
from idem_ros.recording.messages import typestore

LIBRARY = 'idem_ros'  # the default names the version of the mcap package: not reproducible
CHUNK = 2**18  # bytes; of a file cut off, what stands in its last chunk is lost
PIECE = 2**20  # bytes of an attachment: mcap holds three copies of what it is given
OFFERED_QOS = """\
- history: keep_last
  depth: 10
  reliability: reliable
  durability: volatile
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""


def write_mcap(path, messages, metadata=None, attachments=None):
    """Write messages into a new MCAP; it appears at `path` only when it is complete.

    Uncompressed, so that the same messages give the same bytes with every version of zstd.

    Args:
        path: the .mcap file.
        messages: iterable of (topic, log time [ns], message), in the order to be stored; the
            messages are made by `idem_ros.recording.messages` or read from a ROS 2 recording.
            Give each its own log time: of equal ones no format keeps the order.
        metadata: {name: {key: text}} about the recording; None: none.
        attachments: {name: (media type, binary file)}, to carry along; None: none. What is longer
            than `PIECE` goes in pieces, see `embedded.piece_name`.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    with replacing(path) as temporary, temporary.open('wb') as stream:
        writer = Writer(stream, chunk_size=CHUNK, compression=CompressionType.NONE)
        writer.start(profile='ros2', library=LIBRARY)
        channels = {}
        for sequence, (topic, log_time, message) in enumerate(messages):
            if topic not in channels:
                channels[topic] = _register(writer, topic, message.__msgtype__)
            writer.add_message(
                channels[topic],
                log_time,
                bytes(typestore().serialize_cdr(message, message.__msgtype__)),
                publish_time=log_time,
                sequence=sequence,
            )
        for name, entries in (metadata or {}).items():
            writer.add_metadata(name, entries)
        for name, (media_type, content) in (attachments or {}).items():
            _attach(writer, name, media_type, content)
        writer.finish()


def is_foreign(path):
    """Return whether a file is an MCAP, whole or cut off, that `write_mcap` did not write."""
    with path.open('rb') as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            return False
        stream.seek(0)
        try:
            return make_reader(stream).get_header().library != LIBRARY
        except (McapError, ValueError, struct.error):  # of a header that is damaged
            return True


def _attach(writer, name, media_type, content):
    content.seek(0)
    pieces = iter(lambda: content.read(PIECE), b'')
    for k, piece in enumerate(chain([next(pieces, b'')], pieces)):
        # times 0, "not known": the same content gives the same bytes
        writer.add_attachment(0, 0, piece_name(name, k), media_type, piece)


def _register(writer, topic, msgtype):
    definition, type_hash = _type(msgtype)
    schema = writer.register_schema(msgtype, 'ros2msg', definition)
    metadata = {'offered_qos_profiles': OFFERED_QOS, 'topic_type_hash': type_hash}
    return writer.register_channel(topic, 'cdr', schema, metadata)


@cache
def _type(msgtype):
    """Return the definition of a type, and its hash."""
    definition, _ = typestore().generate_msgdef(msgtype, ros_version=2)
    return definition.encode(), typestore().hash_rihs01(msgtype)
