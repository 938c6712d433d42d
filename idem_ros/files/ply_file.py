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
    try:
        ply = PlyData.read(io.BytesIO(b''.join((header.text(element), header.body))), mmap=False)
    except (PlyHeaderParseError, PlyParseError) as error:
        raise UnreadableCloud(f'it is cut off or damaged: {error}') from error
    records = ply.elements[element.index].data
    named = [element.properties[i].name for i in range(len(records.dtype.names))]
    xyz_columns(named, columns)  # before doubled names are told apart
    records = records.copy()
    records.dtype.names = tuple(_distinct(named))
    return points_of_records(records, columns)


def _distinct(names):
    """Give names that come again a number."""
    seen = {}
    for name in names:
        seen[name] = seen.get(name, 0) + 1
    counts, result, taken = {}, [], set(names)
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        new = name if counts[name] == 1 else f'{name}_{counts[name]}'
        while counts[name] > 1 and new in taken:
            new += '_'
        taken.add(new)
        result.append(new)
    return result
