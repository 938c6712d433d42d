"""What is said of a scan where its map has nothing."""

import numpy as np

from idem_ros.core.arrays import Floats, Point, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.trust.reasons import WIDER
from idem_ros.core.trust.verdict import Assessment, Verdict


def outside(bounds: Floats, source: Cloud, T_target_source: Transform) -> Assessment:
    """Return the `Assessment` of a scan that no point of its map is near to.

    Args:
        bounds: (2, 3) lowest and highest coordinates of the map.
        source: the scan.
        T_target_source: (4, 4) its pose, the guess.
    """
    middle = se3.transform_points(T_target_source, source.origin)
    low, high = bounds
    reason = (
        f'the map has nothing near the scan, whose middle is at {_told(middle)} at the guess; '
        f'the map lies from {_told(low)} to {_told(high)}'
    )
    width, of_map = (float(np.max(b - a)) for a, b in (source.extent(), bounds))
    if width > WIDER * of_map:
        reason += f'; the scan is {width:.3g} wide, the map {of_map:.3g}: the same unit?'
    return Assessment(Verdict.SEPARATED, 0.0, reason)


def _told(point: Point) -> str:
    return '(' + ', '.join(f'{x:.10g}' for x in np.round(point, 2)) + ')'
