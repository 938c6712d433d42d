"""The records of a ROS 1 bag one after the other, without the index at its end."""

import io

from rosbags.rosbag1.reader import Header, RecordType, decompressors, normalize
from rosbags.typesys.msg import normalize_msgtype

MAGIC = b'#ROSBAG V2.0\n'


def ros1_messages(path, logged):
    """Yield the messages of a bag up to its end or where it is cut off, None for a damaged chunk.

    Args:
        path: the bag.
        logged: takes (topic, type, definition, log time [ns], bytes, position in the file).
    """
    connections = {}
    with path.open('rb') as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            return
        for header, content, start in _records(stream):
            if header.get('op') != bytes([RecordType.CHUNK]):
                continue
            chunk = _decompressed(header, content)
            if chunk is None:
                yield None
                continue
            inner = io.BytesIO(chunk)
            for each, raw, _ in _records(inner):
                if each['op'][0] == RecordType.CONNECTION:
                    connections[each['conn']] = _connection(each, raw)
                elif each['op'][0] == RecordType.MSGDATA and each['conn'] in connections:
                    position = start + min(inner.tell(), len(content))
                    yield logged(*connections[each['conn']], each.get_time('time'), raw, position)


def _records(stream):
    """Yield (header, content, where that begins); of the last one it may be cut off."""
    while True:
        try:
            header = Header.read(stream)
            size = int.from_bytes(stream.read(4), 'little')
        except Exception:  # damaged bytes raise anything
            return
        start = stream.tell()
        content = stream.read(size)
        whole = len(content) == size
        if header.get('op') is None or not (whole or header['op'][0] == RecordType.CHUNK):
            return
        yield header, content, start


def _decompressed(header, content):
    try:
        return decompressors[header.get_string('compression')](content)
    except Exception:  # of bz2 and lz4, or a compression that there is none of
        return None


def _connection(header, content):
    inner = Header.read(io.BytesIO(len(content).to_bytes(4, 'little') + content))
    return (
        normalize(header.get_string('topic')),
        normalize_msgtype(inner.get_string('type')),
        inner.get_string('message_definition'),
    )
