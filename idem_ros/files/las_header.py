"""What a LAS or LAZ file declares of itself, held against its size before laspy believes it."""

import struct

from idem_ros.files.unreadable import UnreadableCloud

# offsets in the public header block of LAS 1.0 to 1.4, and the least bytes of what is counted
VERSION, HEADER_SIZE, POINTS_AT, POINT_FORMAT, POINT_SIZE = 24, 94, 96, 104, 105
COUNT, EXTENDED_AT, LONG_COUNT = 107, 235, 247
LEAST_RECORD, LEAST_EXTENDED = 54, 60
LEAST_HEADER, LONG_HEADER = 227, 375
PACKED = 0x80  # in the point format: LAZ
MOST_PACKED = 200  # points that LAZ makes of a byte, at most
TABLE_HEAD = 8  # [bytes] of LAZ's table of chunks: its version, and how many there are


def refuse_false_las(content):
    """Refuse bytes that declare more records or points than they can hold.

    Raises:
        UnreadableCloud: says what is declared.
    """
    if content[:4] != b'LASF' or len(content) < LEAST_HEADER:
        raise UnreadableCloud('it does not begin as LAS does (LASF), or is cut off in its header')
    is_long = content[VERSION] == 1 and content[VERSION + 1] >= 4
    if is_long and len(content) < LONG_HEADER:
        raise UnreadableCloud('it is cut off in its header')
    (begin, records), size = _at('<II', content, POINTS_AT), _at('<H', content, POINT_SIZE)[0]
    (head,), (count,) = _at('<H', content, HEADER_SIZE), _at('<I', content, COUNT)
    count = _at('<Q', content, LONG_COUNT)[0] if is_long else count
    _refuse('records', records, LEAST_RECORD, len(content) - head)
    if is_long:
        start, extended = _at('<QI', content, EXTENDED_AT)
        _refuse('extended records', extended, LEAST_EXTENDED, len(content) - start)
    if not content[POINT_FORMAT] & PACKED:
        _refuse('points', count, size, len(content) - begin)
    else:
        _refuse('points', count, 1, MOST_PACKED * (len(content) - begin))
        _refuse_chunks(content, begin)


def _refuse_chunks(content, begin):
    """LAZ keeps before its points where its table of chunks is; -1: at the end."""
    if begin + 8 > len(content):
        raise UnreadableCloud(f'its points begin at byte {begin}, beyond its end')
    (table,) = _at('<q', content, begin)
    table = _at('<q', content, len(content) - 8)[0] if table == -1 else table
    if not begin + 8 <= table <= len(content) - TABLE_HEAD:
        raise UnreadableCloud('its table of chunks lies beyond its end: it is cut off or damaged')
    (chunks,) = _at('<I', content, table + 4)
    _refuse('chunks', chunks, 1, table - begin)


def _at(form, content, offset):
    return struct.unpack_from(form, content, offset)


def _refuse(what, count, least, room):
    if count and count * max(least, 1) > room:
        raise UnreadableCloud(
            f'it is cut off or damaged: it declares {count} {what}, for which '
            f'{max(room, 0)} bytes are too few'
        )
