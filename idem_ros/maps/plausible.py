"""Whether a map is in metres, as far as its points alone can tell."""

import numpy as np
from scipy.spatial import cKDTree

from idem_ros.maps.source import UnusableMap

SAMPLE = 300
WIDEST_SPACING = 5.0  # [m] where it is densest: the sparsest maps have a tenth of it


def require_metres(points, name):
    """Refuse a map whose points stand too far apart to be in metres.

    Args:
        points: (N, 3) of the place where they are densest.
        name: of the map.

    Raises:
        UnusableMap: it is in millimetres, or one of strays.
    """
    if len(points) < 5:
        raise UnusableMap(
            f'{name} holds {len(points)} points where it is densest; a map has 5 at least'
        )
    some = points[:: max(len(points) // SAMPLE, 1)]
    spacing = float(np.median(cKDTree(points).query(some, 5)[0][:, 4]))
    if spacing > WIDEST_SPACING:
        raise UnusableMap(
            f'{name}: its points stand {spacing:.3g} apart where they are densest, and those of a '
            f'map in metres less than {WIDEST_SPACING:g}; is it in millimetres?'
        )
