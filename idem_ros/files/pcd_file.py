"""Clouds as PCL writes them: ascii, binary and compressed."""

import re
import struct
from typing import NamedTuple

import numpy as np

from idem_ros.files.columns import xyz_columns
from idem_ros.files.text_lines import with_plain_nans
from idem_ros.files.unreadable import UnreadableCloud

LONGEST = 1 << 20  # [bytes] of header; more is none
WORDS = {b'VERSION', b'FIELDS', b'COLUMNS', b'SIZE', b'TYPE', b'COUNT', b'WIDTH', b'HEIGHT'}
WORDS |= {b'VIEWPOINT', b'POINTS', b'DATA'}
ENCODINGS = ('ascii', 'binary', 'binary_compressed')
KINDS = {'F': (2, 4, 8), 'I': (1, 2, 4, 8), 'U': (1, 2, 4, 8)}
MOST_BYTES = 1 << 20  # of a point
WORD = re.compile(rb'\w{1,40}$')
LINE = re.compile(rb'([^\r\n]*)(\r\n|\n|\r)')

# LZF makes of three bytes at most 264; nothing that is larger can come of a file
MOST_INFLATED = 100
PADDING = b'\0\r\n '  # that writers add


class PcdField(NamedTuple):
    """A field of each point."""

    name: str
    dtype: str  # of NumPy, little endian
    count: int


class PcdHeader(NamedTuple):
    """What a PCD file says of itself."""

    fields: tuple[PcdField, ...]  # those of COUNT 0 are left out
    points: int
    encoding: str
    body: int  # where the points begin

    @property
    def size(self):
        """Bytes of a point."""
        return sum(np.dtype(field.dtype).itemsize * field.count for field in self.fields)


def read_pcd_header(content):
    """Return the `PcdHeader` of a file's bytes, be they mapped.

    Raises:
        UnreadableCloud: in the words of PCD, what is missing or contradicts itself.
    """
    lines, at = {}, 3 if content[:3] == b'\xef\xbb\xbf' else 0
    while b'DATA' not in lines:
        line = LINE.match(content, at, min(len(content), at + LONGEST))
        if line is None or at > LONGEST:
            raise UnreadableCloud('it has no line DATA, so it is no PCD file or cut off')
        at = line.end()
        words = line[1].split()
        if not words or words[0].startswith(b'#'):
            continue
        word = words[0].upper()
        if not WORD.match(word):
            raise UnreadableCloud('it has no line DATA, so it is no PCD file or cut off')
        if word not in WORDS:
            raise UnreadableCloud(f'its header has a line {_shown(line[1])}, which PCD has not')
        if word in lines:
            raise UnreadableCloud(f'its header has two lines {word.decode()}')
        lines[word] = [word.decode('utf-8', 'replace') for word in words[1:]]
    encoding = ' '.join(lines[b'DATA']).lower().replace('binaryscompressed', 'binary_compressed')
    if encoding not in ENCODINGS:
        raise UnreadableCloud(f'its DATA is {_shown(encoding)}; it must be {", ".join(ENCODINGS)}')
    return PcdHeader(_fields(lines), _points(lines), encoding, at)


def _fields(lines):
    names = lines.get(b'FIELDS') or lines.get(b'COLUMNS')
    if not names:
        raise UnreadableCloud('its header has no FIELDS')
    kinds = [kind.upper() for kind in lines.get(b'TYPE', ['F'] * len(names))]
    sizes = _whole('SIZE', lines.get(b'SIZE', ['4'] * len(names)))
    counts = _whole('COUNT', lines.get(b'COUNT', ['1'] * len(names)))
    for word, entries in (('SIZE', sizes), ('TYPE', kinds), ('COUNT', counts)):
        if len(entries) != len(names):
            raise UnreadableCloud(f'{word} has {len(entries)} entries, FIELDS {len(names)}')
    for name, kind, size in zip(names, kinds, sizes, strict=True):
        if size not in KINDS.get(kind, ()):
            raise UnreadableCloud(
                f'field {_shown(name)} is of TYPE {_shown(kind)} and SIZE {size}: no type of PCD'
            )
    fields = tuple(
        PcdField(name, f'<{kind.lower()}{size}', count)
        for name, kind, size, count in zip(names, kinds, sizes, counts, strict=True)
        if count
    )
    size = sum(size * count for size, count in zip(sizes, counts, strict=True))
    if size > MOST_BYTES:
        raise UnreadableCloud(f'its COUNT and SIZE make {size} bytes a point')
    return fields


def _points(lines):
    one = {
        word: _whole(word.decode(), lines[word])
        for word in (b'WIDTH', b'HEIGHT', b'POINTS')
        if word in lines
    }
    for word, numbers in one.items():
        if len(numbers) != 1:
            raise UnreadableCloud(f'its {word.decode()} holds {len(numbers)} numbers')
    told = [one[b'POINTS'][0]] if b'POINTS' in one else []
    if b'WIDTH' in one:
        told.append(one[b'WIDTH'][0] * one.get(b'HEIGHT', [1])[0])
    if not told:
        raise UnreadableCloud('its header has neither POINTS nor WIDTH')
    if min(told) != max(told):
        raise UnreadableCloud(f'POINTS is {told[0]}, WIDTH x HEIGHT is {told[1]}')
    return told[0]


def _whole(word, entries):
    if not all(entry.isdecimal() and len(entry) < 16 for entry in entries):
        raise UnreadableCloud(
            f'its {word} is {_shown(" ".join(entries))}; it must be whole numbers'
        )
    return [int(entry) for entry in entries]


def _shown(text):
    text = text.decode('utf-8', 'replace') if isinstance(text, bytes) else text
    return repr(text[:40])


def read_pcd(path, columns=None):
    """Read (N, 3) points of a PCD file.

    Nothing is allocated that its bytes do not fill.
    """
    (points,) = pcd_parts(path, columns)
    return points


def pcd_parts(path, columns=None, most=None):
    """Yield the points of a PCD file, `most` at a time where it is binary, else all at once."""
    with path.open('rb') as stream:
        header = read_pcd_header(stream.read(2 * LONGEST))
        names = [field.name for field in header.fields]
        chosen = [header.fields[i] for i in xyz_columns(names, columns)]
        if any(field.count != 1 for field in chosen):
            raise UnreadableCloud('its x, y, z have a COUNT that is not 1')
        if header.points == 0:
            raise UnreadableCloud('it says itself that it holds 0 points')
        stream.seek(header.body)
        if header.encoding == 'binary':
            room = path.stat().st_size - header.body
            yield from _rows(header, stream, room, chosen, most or header.points)
        elif header.encoding == 'ascii':
            yield _ascii(header, stream.read(), chosen)
        else:
            yield _compressed(header, memoryview(stream.read()), chosen)


def pcd_names(path, columns=None):
    """Return the names of the fields of a PCD file."""
    with path.open('rb') as stream:
        return [field.name for field in read_pcd_header(stream.read(2 * LONGEST)).fields]


def write_pcd(path, points, dtype: type = np.float32):
    """Write (N, 3) points as a binary PCD of fields x, y, z.

    Args:
        path: `Path` of the file.
        points: finite.
        dtype: np.float32 or np.float64; PCL takes x, y, z of float32 only.
    """
    packed = np.ascontiguousarray(points, np.dtype(dtype).newbyteorder('<'))
    with path.open('wb') as stream:
        stream.write(pcd_header(len(packed), dtype))
        stream.write(packed)


def pcd_header(count, dtype: type = np.float32):
    """Return the bytes before the little-endian points of a binary PCD; see `write_pcd`."""
    size = np.dtype(dtype).itemsize
    return (
        '# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\n'
        f'SIZE {size} {size} {size}\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n'
        f'VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n'
    ).encode()


def _rows(header, stream, room, chosen, most):
    """Yield points of the rows that follow in a stream, of which it holds `room` bytes."""
    if header.points * header.size > room:
        _cut_off(header, room // max(header.size, 1))
    dtype = np.dtype([(f'{i}', f.dtype, f.count) for i, f in enumerate(header.fields)])
    for begin in range(0, header.points, most):
        rows = np.fromfile(stream, dtype, min(most, header.points - begin))
        yield _stacked(rows[f'{header.fields.index(field)}'] for field in chosen)
    if len(stream.read().strip(PADDING)) >= header.size:
        _too_many(header, room // header.size)


def _compressed(header, body, chosen):
    import lzf

    if len(body) < 8:
        _cut_off(header, 0)
    packed, unpacked = struct.unpack('<II', body[:8])
    if unpacked != header.points * header.size:
        raise UnreadableCloud(
            f'it inflates to {unpacked} bytes, and {header.points} points of {header.size} bytes '
            f'are {header.points * header.size}'
        )
    if packed > len(body) - 8 or unpacked > MOST_INFLATED * packed:
        raise UnreadableCloud(
            f'it is cut off or damaged: {len(body) - 8} bytes cannot inflate to {unpacked}'
        )
    # as many bytes as come out of LZF were packed as they are
    content = body[8 : 8 + packed]
    content = lzf.decompress(bytes(content), unpacked) if packed != unpacked else content
    if content is None or len(content) != unpacked:
        raise UnreadableCloud('its compressed points are damaged')
    found, at = {}, 0
    for field in header.fields:  # field after field, not point after point
        if field in chosen:
            found[field] = np.frombuffer(content, field.dtype, header.points, at)
        at += np.dtype(field.dtype).itemsize * field.count * header.points
    return _stacked(found[field] for field in chosen)


def _ascii(header, body, chosen):
    rows = [row for row in with_plain_nans(body).splitlines() if row.strip()]
    if len(rows) < header.points:
        _cut_off(header, len(rows))
    if len(rows) > header.points:
        _too_many(header, len(rows))
    width = sum(field.count for field in header.fields)
    starts = np.cumsum([0, *(field.count for field in header.fields)])
    at = [int(starts[header.fields.index(field)]) for field in chosen]
    points = np.empty((header.points, 3))
    for i, row in enumerate(rows):
        words = row.split()
        if len(words) != width:
            raise UnreadableCloud(
                f'point {i + 1} holds {len(words)} numbers, and its FIELDS and COUNT {width}'
            )
        try:
            points[i] = [float(words[k]) for k in at]
        except ValueError as error:
            shown = _shown(b' '.join(words[k] for k in at))
            raise UnreadableCloud(f'point {i + 1} is no point: x, y, z are {shown}') from error
    return points


def _stacked(columns):
    columns = [column.reshape(-1) for column in columns]
    points = np.empty((len(columns[0]), 3))
    for axis, column in enumerate(columns):
        points[:, axis] = column
    return points


def _cut_off(header, found):
    raise UnreadableCloud(
        f'it is cut off: it holds {found} points where the header says {header.points}'
    )


def _too_many(header, found):
    raise UnreadableCloud(f'it holds {found} points where the header says {header.points}')
