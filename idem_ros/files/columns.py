"""Which columns of a table, or fields of a record, are x, y and z."""

import logging
import re

import numpy as np

from idem_ros.files.unreadable import UnreadableCloud

SHOWN = 12  # names in a message
UNIT = re.compile(r'[\[({][^\])}]*[\])}]')
TOKEN = re.compile(r'[^\W_]+')
FILLING = {'point', 'points', 'pos', 'position', 'coord', 'coords', 'coordinate', 'coordinates'}
FILLING |= {
    'koordinate',
    'koordinaten',
    'm',
    'xyz',
    'cartesian',
    'field',
    'vertex',
}  # Points_m_XYZ:0, position.x, x_m
WORDS = (
    {'x', 'easting', 'east', 'rechtswert', 'e'},
    {'y', 'northing', 'north', 'hochwert', 'n'},
    {'z', 'elevation', 'elev', 'height', 'altitude', 'up', 'höhe', 'hoehe', 'h'},
)
logger = logging.getLogger(__name__)
XCOORD = re.compile(r'([xyz])_?(?:coord|coordinate|pos)s?$|(?:coord|pos)_?([xyz])$')

METRES = ('', 'm', 'metre', 'meter', 'metres', 'meters')
ANGLES = ('deg', 'degree', 'degrees', 'rad', 'radian', 'radians', '°', 'gon')

VECTORS = ('xyz', 'points', 'point', 'position', 'positions', 'pos', 'coords')  # of three


def xyz_columns(names, columns=None):
    """Return the indices of x, y and z among names.

    Args:
        names: list of the columns' names, in their order; '' for one without.
        columns: three names, or numbers from 1, chosen by the user; None: by what names mean.
            Numbers that are all names are names.

    Raises:
        UnreadableCloud: they are not there, or more than one could be meant.
    """
    if columns is not None:
        by_name = all(names.count(str(column)) for column in columns)
        return tuple(_chosen(column, names, by_name) for column in columns)
    for known in (_exact, _folded, _meant):
        found = [[i for i, name in enumerate(names) if known(name) == axis] for axis in range(3)]
        if all(len(each) == 1 for each in found):
            return tuple(each[0] for each in found)
    raise UnreadableCloud(
        f'its columns are {_listed(names)}; which of them are x, y and z must be said: '
        '--columns NAME,NAME,NAME'
    )


def note_unit(path, names):
    """Say in which unit the names of x, y and z have them, where it is not the metre.

    Raises:
        UnreadableCloud: they are angles, or in more than one unit.
    """
    found = [UNIT.search(name) for name in names]
    said = {unit[0][1:-1].strip().lower() for unit in found if unit}
    units = sorted(unit for unit in said if unit.isalpha() or unit in ANGLES)
    if len(units) > 1 or any(unit in ANGLES for unit in units):
        raise UnreadableCloud(
            f'its x, y and z are in {" and ".join(units)}; they must be in one unit of length'
        )
    if units and units[0] not in METRES:
        logger.warning(
            '%s: its header has x, y and z in %s, and so are they taken: lengths that are given '
            'and those of the result are in %s',
            *(path, units[0], units[0]),
        )


def numbered_columns(count, columns):
    """Return three indices of a table without names, given numbers from 1."""
    return tuple(_chosen(column, [''] * count, by_name=False) for column in columns)


def parse_columns(text):
    """Read what `--columns` is given: a number of columns, or three names or numbers.

    Raises:
        ValueError: anything else.
    """
    parts = [part.strip() for part in text.split(',')]
    if len(parts) == 1 and parts[0].isdecimal() and 0 < len(parts[0]) < 4:
        return int(parts[0])
    if len(parts) != 3 or not all(parts):
        raise ValueError(f'{text!r} is neither a number of columns nor three names or numbers')
    if len(set(parts)) < 3:
        raise ValueError(f'{text!r} names a column twice; x, y and z are three')
    return tuple(int(part) if part.isdecimal() else part for part in parts)


def _chosen(column, names, by_name):
    if isinstance(column, int) and not by_name:
        if not 1 <= column <= len(names):
            raise UnreadableCloud(f'it has columns 1 to {len(names)}, and no column {column}')
        return column - 1
    if names.count(str(column)) != 1:
        raise UnreadableCloud(f'no column, or more than one, is called {column!r} {_of(names)}')
    return names.index(str(column))


def _of(names):
    return f'among {_listed(names)}' if any(names) else 'in a table without names; give numbers'


def _listed(names):
    shown = ', '.join(repr(str(name)[:40]) for name in names[:SHOWN])
    return shown + (f' and {len(names) - SHOWN} more' if len(names) > SHOWN else '')


def _exact(name):
    return 'xyz'.find(name) if len(name) == 1 else -1


def _folded(name):
    return _exact(name.strip().lower())


def _meant(name):
    """Return the axis that a name means, 0 to 2; -1 for none."""
    plain = UNIT.sub(' ', name.strip().lower())
    glued = XCOORD.search(plain.strip())
    if glued and len(plain.strip()) == len(glued[0]):
        return 'xyz'.index(glued[1] or glued[2])
    tokens = TOKEN.findall(plain)
    rest = [token for token in tokens if token not in FILLING]
    if len(rest) != 1:
        return -1
    if rest[0] in ('0', '1', '2') and len(tokens) > 1:
        return int(rest[0])
    return next((axis for axis, words in enumerate(WORDS) if rest[0] in words), -1)


def points_of_records(records, columns=None):
    """Return (N, 3) float64 of a structured array of any shape, by the names of its fields."""
    records = np.ravel(records)
    names = list(records.dtype.names or ())
    for name in names:
        shape = records.dtype[name].shape
        if columns is None and name.lower() in VECTORS and shape == (3,):
            return _real(records[name], name)
    chosen = [names[i] for i in xyz_columns(names, columns)]
    for name in chosen:
        if records.dtype[name].shape not in ((), (1,)):
            raise UnreadableCloud(f'its field {name} holds {records.dtype[name].shape} numbers')
    return np.stack([_real(records[name], name).reshape(-1) for name in chosen], axis=1)


def _real(values, name):
    if values.dtype.kind not in 'fiu':
        raise UnreadableCloud(f'its field {name} is of {values.dtype}, no real numbers')
    return values.astype(np.float64)
