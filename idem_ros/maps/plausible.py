"""Whether a map is in metres, as far as its points alone can tell."""

import numpy as np
from scipy.spatial import KDTree

from idem_ros.maps.source import UnusableMap

PLACES = 8  # of which the densest counts
AROUND = 32.0  # [m] of a place, along each axis
SAMPLE = 100  # points of a place
WIDEST_SPACING = 5.0  # [m]: the sparsest maps have a tenth of it where they are densest


def require_metres(points, within, name):
    """Refuse a map whose points stand too far apart to be in metres.

    Args:
        points: (N, 3) of the map, or of a part of it.
        within: gives those of a box, as `MapSource.points_within` does.
        name: of the map.

    Raises:
        UnusableMap: it is in millimetres, or one of strays.
    """
    places = points[:: max(len(points) // PLACES, 1)]
    spacing = min(_spacing(within(place - AROUND, place + AROUND)) for place in places)
    if spacing > WIDEST_SPACING:
        found = f'{spacing:.3g} apart' if np.isfinite(spacing) else f'{AROUND:g} and more apart'
        raise UnusableMap(
            f'{name}: its points stand {found} where they are densest, and those of a map in '
            f'metres less than {WIDEST_SPACING:g}; is it in millimetres?'
        )


def _spacing(points):
    """Return the median distance to the fourth neighbour; infinite where there is none."""
    some = points[:: max(len(points) // SAMPLE, 1)]
    return float(np.median(KDTree(points).query(some, 5)[0][:, 4])) if len(points) else np.inf
