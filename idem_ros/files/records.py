"""Points out of arrays with named fields."""

import numpy as np

from idem_ros.files.columns import xyz_columns
from idem_ros.files.unreadable import UnreadableCloud

VECTORS = ('xyz', 'points', 'point', 'position', 'positions', 'pos', 'coords')  # of three


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
