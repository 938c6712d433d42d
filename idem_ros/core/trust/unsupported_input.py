"""What clouds cannot be judged: all in one plane, rounded too coarsely, or of another scale.

A verdict on such clouds would be about what they have lost, so it is not given; nor is one on a
scan where its map has nothing.
"""

from dataclasses import replace

import numpy as np

from idem_ros.core.arrays import Floats, Point, Points, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.symmetric3 import adjugate, determinant, trace
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.trust.agreement import Agreement
from idem_ros.core.trust.reasons import WIDER
from idem_ros.core.trust.scale import scale_left_open
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, Assessment, Verdict

FLAT = 1e-3  # of the radius: no point of a scan in a plane is farther from it
COARSE = (
    0.25  # of the radius: a room's error grows tenfold from there on, and p says nothing of it
)
MOST_VOLUMES = 0.5  # of the balls: more, and no surface is seen
FLOAT32_STEP = 2.0**-23  # of a number: the coarsest that float32 rounds it to
FEW, SAMPLE = 64, 1000  # points, about
CANCELLED = 1e-9  # of the cube of the trace: what rounding leaves of a determinant is far less


def out_of_scope(target: Cloud, source: Cloud, radius: float) -> str:
    """Say why clouds cannot be judged at all, in one line; empty where they can.

    Args:
        target, source: `Cloud`s, as given (of points, not of voxels).
        radius: of the balls that judge them.
    """
    if all(_is_flat(cloud.points, FLAT * radius) for cloud in (target, source)):
        return 'all points lie in one plane: scans of 2D scanners are not supported'
    for name, cloud in (('target', target), ('source', source)):
        axis, step = _coarsest_axis(cloud, COARSE * radius)
        if step:
            return (
                f'{axis} of the {name} stands in steps of {step:.2g}, as float32 leaves it so far '
                'from zero: subtract an offset before rounding to float32'
            )
    return ''


def judged_in_scope(
    assessment: Assessment,
    target: Cloud,
    source: Cloud,
    balls: Balls,
    agreement: Agreement,
    T: Transform,
) -> Assessment:
    """Return an `Assessment` as it is, or what is left of it where clouds are out of scope.

    Args:
        assessment: the `Assessment` of a pose.
        target, source: `Cloud`s, as given.
        balls: `Balls` of the last radius, that judged it.
        agreement: the `Agreement` there.
        T: (4, 4) the pose, between the clouds' origins.
    """
    is_good = assessment.p_aligned >= LEAST_PROBABILITY
    reason = out_of_scope(target, source, balls.radius)
    if is_good and not reason:
        reason = _filled_volume(balls)
    if reason:
        return replace(
            assessment, verdict=Verdict.NOT_CONVERGED, p_aligned=np.nan, reason=reason, free=''
        )
    reason = scale_left_open(balls, agreement.reach, agreement.overlap, T) if is_good else ''
    if reason:
        return replace(assessment, verdict=Verdict.LOW_OVERLAP, p_aligned=np.nan, reason=reason)
    return assessment


def _filled_volume(balls: Balls) -> str:
    for name, shapes in zip(('target', 'source'), balls.shapes(), strict=True):
        if shapes.volumes > MOST_VOLUMES:
            return f'the {name} holds no surfaces: its points fill a volume, as noise does'
    return ''


def _is_flat(points: Points, thickness: float) -> bool:
    few = points[:: max(len(points) // FEW, 1)]  # already the best plane of these may tell
    if _surely_spreads(few, thickness):
        return False
    sample = _sampled(points)
    middle = sample.mean(axis=0)
    away = sample - middle
    _, axes = np.linalg.eigh(away.T @ away)
    off: Floats = (points - middle) @ axes[:, 0]
    return bool((np.abs(off) <= thickness).all())


def _surely_spreads(points: Points, thickness: float) -> bool:
    """Whether no plane is as near to all points (N, 3) as the thickness.

    Of their scatter det over the sum of principal minors is at most the least eigenvalue, which
    of points that near to a plane is N thickness^2 at most.
    """
    away = points - points.mean(axis=0)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = (away.T @ away).tolist()
    s = xx, xy, xz, yy, yz, zz
    least = len(points) * thickness**2 * trace(adjugate(s))
    return determinant(s) > max(least, CANCELLED * trace(s) ** 3)


def _coarsest_axis(cloud: Cloud, tolerated: float) -> tuple[str, float]:
    """Return the axis that float32 has rounded most, and its step; 0.0 where none is coarse."""
    farthest = np.abs(np.add(cloud.bounds(), cloud.origin)).max()
    if farthest * FLOAT32_STEP <= tolerated:
        return '', 0.0
    sample = _sampled(cloud.points) + cloud.origin
    # where half of them are: a stray, however far, says nothing of the others
    steps = np.spacing(np.median(np.abs(sample), axis=0).astype(np.float32))
    axis = int(np.argmax(steps))
    values = sample[:, axis]
    # doubles, and what was printed with all its digits, stand between the steps
    is_rounded = steps[axis] > tolerated and (values.astype(np.float32) == values).all()
    return 'xyz'[axis], float(steps[axis]) if is_rounded else 0.0


def _sampled(points: Points) -> Points:
    return points[:: max(len(points) // SAMPLE, 1)]


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
