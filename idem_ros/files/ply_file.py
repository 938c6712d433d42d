"""Clouds as PLY: by plyfile, from a header that is made regular and checked against its bytes."""

import io
import re
from dataclasses import dataclass, field

import numpy as np

from idem_ros.files.columns import points_of_records, xyz_columns
from idem_ros.files.text_lines import with_plain_nans
from idem_ros.files.unreadable import UnreadableCloud

LONGEST = 1 << 20  # [bytes] of header; more is none
LINE = re.compile(rb'([^\r\n]*)(\r\n|\n|\r)')
MARK = b'\xef\xbb\xbf'
FORMATS = ('ascii', 'binary_little_endian', 'binary_big_endian')
TYPES = {'char': 'i1', 'uchar': 'u1', 'short': 'i2', 'ushort': 'u2', 'int': 'i4', 'uint': 'u4'}
TYPES |= {'float': 'f4', 'double': 'f8', 'int8': 'i1', 'uint8': 'u1', 'int16': 'i2'}
TYPES |= {'uint16': 'u2', 'int32': 'i4', 'uint32': 'u4', 'float32': 'f4', 'float64': 'f8'}
VERTEX = ('vertex', 'vertices')


@dataclass
class PlyField:
    """A property of an element: a number, or a list with the type of its length."""

    name: str
    types: tuple[str, ...]

    @property
    def least(self):
        """The least bytes that it takes in a binary file."""
        return np.dtype(self.types[0]).itemsize


@dataclass
class PlyElement:
    """An element: so many rows of its properties."""

    name: str
    count: int
    index: int
    properties: list[PlyField] = field(default_factory=list)


@dataclass
class PlyHeader:
    """What a PLY file says of itself, and the bytes after it."""

    format: str
    elements: list[PlyElement]
    body: bytes | memoryview

    def vertices(self, columns=None):
        """Return the element whose rows are points.

        Raises:
            UnreadableCloud: none is, or more than one may be.
        """
        called = [each for each in self.elements if each.name.lower() in VERTEX]
        found = called or [each for each in self.elements if _has_points(each, columns)]
        if len(found) != 1:
            names = ', '.join(repr(each.name[:40]) for each in self.elements) or 'none'
            raise UnreadableCloud(f'it must have one element vertex; it has: {names}')
        return found[0]

    def text(self, until):
        """Return a regular header, up to an element: what comes after needs no reading."""
        lines = ['ply', f'format {self.format} 1.0']
        for element in self.elements[: until.index + 1]:
            lines.append(f'element e{element.index} {element.count}')
            for i, each in enumerate(element.properties):
                kind = ' '.join(('list',) * (len(each.types) == 2) + each.types)
                lines.append(f'property {kind} p{i}')
        return ('\n'.join(lines) + '\nend_header\n').encode()


def read_ply_header(content):
    """Return the `PlyHeader` of a file's bytes.

    Lines of other words are comments of scanners. More rows than the bytes can hold are refused.
    """
    at = len(MARK) if content.startswith(MARK) else 0
    form, elements, number = None, [], 0
    while True:
        line = LINE.match(content, at, min(len(content), at + LONGEST))
        if line is None or at > LONGEST:
            raise UnreadableCloud('its header has no line end_header: no PLY file, or cut off')
        at, number = line.end(), number + 1
        words = line[1].decode('utf-8', 'replace').split()
        if number == 1 and words[:1] != ['ply']:
            raise UnreadableCloud('it does not begin with the line "ply"')
        if words == ['end_header']:
            break
        if words[:1] == ['format']:
            form = _format(words)
        elif words[:1] == ['element']:
            elements.append(_element(words, len(elements)))
        elif words[:1] == ['property']:
            _add_property(elements, words)
    if form is None:
        raise UnreadableCloud('its header has no line format')
    body = memoryview(content)[at:]
    if form == 'ascii':
        text = with_plain_nans(content[at:].removeprefix(MARK))
        lines = text.replace(b'\r', b'\n').split(b'\n')
        body = b'\n'.join(line for line in lines if line.strip()) + b'\n'
    _refuse_short(form, elements, body)
    return PlyHeader(form, elements, body)


def _format(words):
    if len(words) != 3 or words[1].lower() not in FORMATS:
        raise UnreadableCloud(f'its format is {_shown(words[1:])}; PLY has {", ".join(FORMATS)}')
    return words[1].lower()


def _element(words, index):
    if len(words) != 3 or not words[2].isdecimal() or len(words[2]) > 15:
        raise UnreadableCloud(f'its header has a line {_shown(words)}; it must say name and count')
    return PlyElement(words[1], int(words[2]), index)


def _add_property(elements, words):
    is_list = words[1:2] == ['list']
    kinds = words[2:4] if is_list else words[1:2]
    length = 5 if is_list else 3
    if not elements or len(words) != length or not all(kind.lower() in TYPES for kind in kinds):
        raise UnreadableCloud(f'its header has a line {_shown(words)}, which PLY has not')
    types = tuple(TYPES[kind.lower()] for kind in kinds)
    if is_list and types[0][0] == 'f':
        raise UnreadableCloud(f'its header has a line {_shown(words)}: no length is a fraction')
    elements[-1].properties.append(PlyField(words[-1], types))


def _refuse_short(form, elements, body):
    for element in elements:
        if element.count and not element.properties:
            raise UnreadableCloud(f'its element {element.name[:40]!r} has no property')
    if form == 'ascii':
        wanted, found, unit = sum(each.count for each in elements), body.count(b'\n'), 'lines'
    else:
        least = [sum(each.least for each in element.properties) for element in elements]
        wanted = sum(n * each.count for n, each in zip(least, elements, strict=True))
        found, unit = len(body), 'bytes'
    if form == 'ascii' and found > wanted:
        raise UnreadableCloud(f'its header declares {wanted} lines, and {found} follow')
    if wanted > found:
        raise UnreadableCloud(
            f'it is cut off: its header declares {wanted} {unit} or more, and {found} follow'
        )


def _has_points(element, columns):
    try:
        xyz_columns([each.name for each in element.properties], columns)
    except UnreadableCloud:
        return False
    return True


def _shown(words):
    return repr(' '.join(words)[:60])


def read_ply(path, columns=None):
    """Read (N, 3) points of the element `vertex`, or of the only one that has x, y, z."""
    from plyfile import PlyData, PlyHeaderParseError, PlyParseError

    header = read_ply_header(path.read_bytes())
    element = header.vertices(columns)
    names = [each.name for each in element.properties]
    xyz_columns(names, columns)  # before others of the same name are told apart
    regular = io.BytesIO(b''.join((header.text(element), header.body)))
    try:
        ply = PlyData.read(regular, mmap=False)  # pyright: ignore[reportArgumentType]
    except (PlyHeaderParseError, PlyParseError) as error:
        raise UnreadableCloud(f'it is not as its header says: {_said(error, header)}') from error
    records = ply.elements[element.index].data.copy()
    records.dtype.names = tuple(
        name if names.count(name) == 1 else f'{name} {i}' for i, name in enumerate(names)
    )
    return points_of_records(records, columns)


def ply_names(path, columns=None):
    """Return the names of the properties of the points of a PLY file."""
    element = read_ply_header(path.read_bytes()).vertices(columns)
    return [each.name for each in element.properties]


def _said(error, header):
    """Return what plyfile says, with the file's own names for those of the regular header."""
    text = str(error)
    for element in header.elements:
        if f"'e{element.index}'" in text:
            text = text.replace(f"'e{element.index}'", repr(element.name[:40]))
            for i, each in enumerate(element.properties):
                text = text.replace(f"'p{i}'", repr(each.name[:40]))
    return text
