"""The header of a PCD file, with what the format says holds where a line is missing."""

import re
from typing import NamedTuple

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

LONGEST = 1 << 20  # [bytes] of header; more is none
WORDS = {b'VERSION', b'FIELDS', b'COLUMNS', b'SIZE', b'TYPE', b'COUNT', b'WIDTH', b'HEIGHT'}
WORDS |= {b'VIEWPOINT', b'POINTS', b'DATA'}
ENCODINGS = ('ascii', 'binary', 'binary_compressed')
KINDS = {'F': (2, 4, 8), 'I': (1, 2, 4, 8), 'U': (1, 2, 4, 8)}
MOST_BYTES = 1 << 20  # of a point
WORD = re.compile(rb'\w{1,40}$')
LINE = re.compile(rb'([^\r\n]*)(\r\n|\n|\r)')


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
