"""Clouds as PLY: by plyfile, from a header that is made regular first."""

import io

from idem_ros.files.columns import xyz_columns
from idem_ros.files.ply_header import read_ply_header
from idem_ros.files.records import points_of_records
from idem_ros.files.unreadable import UnreadableCloud


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
