"""The motion of a sensor during its sweep, undone: every point into the frame at one instant.

By one twist; or by a table of motions at equal steps.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats, Points, Transforms
from idem_ros.core.config import MOTION_REFERENCES
from idem_ros.core.exceptions import InvalidCloud, InvalidConfig, InvalidTransform
from idem_ros.core.jit import kernel

LONGEST_SWEEP = 1.0  # [s]: no scanner takes longer for a turn; clocks that jump do
TURN = 2.0 * np.pi
TERMS = 13  # of sine and 1 - cosine: all digits up to half a turn
STILL = 1e-30  # [rad/s]: what is divided by in place of a rate of 0

Reference: TypeAlias = str | float


def undistort(
    points: ArrayLike, times: ArrayLike, twist: ArrayLike, reference: Reference = 'stamp'
) -> Points:
    """Return points as a sensor would have seen them that stood still at one instant.

    A sensor that moves by a constant twist has the pose T exp(t twist) at the time t, T at the
    stamp: a point p of the time t is exp((t - t_ref) twist) p in the frame at t_ref.

    Args:
        points: (N, 3), each in the sensor's frame at its own time; not finite ones stay so.
        times: (N,) [s] from the stamp.
        twist: (6,) x y z [length/s] rx ry rz [rad/s] of the sensor, in its own axes.
        reference: the instant: one of `MOTION_REFERENCES`, or its time [s] from the stamp.

    Raises:
        InvalidCloud: points that are not (N, 3), or times that are not N numbers, finite where
            the point is.
        InvalidTransform: the twist is not six finite numbers.
        InvalidConfig: another reference.
    """
    points = _checked(points, 'points', (-1, 3))
    times = checked_times(times, points)
    undone = np.empty_like(points)
    undo(points, times, checked_twist(twist), reference_time(times, reference), undone)
    return undone


def reference_time(times: Floats, reference: Reference) -> float:
    """Return the time [s] from the stamp of a reference; see `undistort`.

    Raises:
        InvalidConfig: it is neither a time nor one of `MOTION_REFERENCES`.
    """
    if not isinstance(reference, str):
        if not np.isfinite(reference):
            raise InvalidConfig(f'reference is {reference!r}; it must be a finite time [s]')
        return float(reference)
    if reference not in MOTION_REFERENCES:
        raise InvalidConfig(f'reference is {reference!r}; it must be one of {MOTION_REFERENCES}')
    if reference == 'stamp' or len(times) == 0:
        return 0.0
    begin, end = float(np.nanmin(times)), float(np.nanmax(times))
    return {'begin': begin, 'middle': (begin + end) / 2, 'end': end}[reference]


def checked_times(times: ArrayLike, points: Points) -> Floats:
    """Return the times of (N, 3) points as (N,) float64.

    Raises:
        InvalidCloud: they are not N numbers, or not finite for a finite point.
    """
    result = _checked(times, 'times', (len(points),))
    if not np.isfinite(result).all():
        lacking = ~np.isfinite(result) & np.isfinite(points).all(axis=1)
        if lacking.any():
            raise InvalidCloud(
                f'{np.count_nonzero(lacking)} of {len(points)} points have no finite time; '
                'all must, or give no times'
            )
    return result


def checked_twist(twist: ArrayLike) -> Floats:
    """Return a twist as (6,) float64.

    Raises:
        InvalidTransform: it is not six finite numbers.
    """
    try:
        result = np.ascontiguousarray(twist, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidTransform(f'twist is not an array of numbers: {error}') from error
    if result.shape != (6,) or not np.isfinite(result).all():
        raise InvalidTransform(f'twist is {twist!r}; it must be six finite numbers per second')
    return result


def flaw_of_times(times: Floats) -> str:
    """Say why times (N,) [s] tell nothing of a sweep, in a few words; empty where they do."""
    if len(times) == 0:
        return 'there are no points'
    begin, end = float(times.min()), float(times.max())
    if begin == end:
        return f'all points have the time {begin:g} s'
    if end - begin > LONGEST_SWEEP:
        return f'the times span {end - begin:.3g} s; a sweep takes {LONGEST_SWEEP:g} s at most'
    farthest = max(abs(begin), abs(end))
    if farthest > LONGEST_SWEEP:
        return f'a time is {farthest:.3g} s from the stamp: times of another sweep'
    return ''


def _checked(values: ArrayLike, name: str, shape: tuple[int, ...]) -> Floats:
    try:
        result = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidCloud(f'{name} are not an array of numbers: {error}') from error
    if result.ndim != len(shape) or any(
        size not in (-1, found) for size, found in zip(shape, result.shape, strict=True)
    ):
        right = str(shape).replace('-1', 'N')
        raise InvalidCloud(f'{name} have the shape {result.shape}; it must be {right}')
    return result


@kernel
def undo(points: Points, times: Floats, twist: Floats, reference: float, undone: Points) -> None:
    """Fill undone (N, 3) with exp((t - reference) twist) p: a screw about one axis.

    Sine and 1 - cosine are written out, without a branch: the loop is vector code.
    """
    vx, vy, vz, wx, wy, wz = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    rate = max(np.sqrt(wx * wx + wy * wy + wz * wz), STILL)
    nx, ny, nz = wx / rate, wy / rate, wz / rate
    along = nx * vx + ny * vy + nz * vz
    bx, by, bz = (ny * vz - nz * vy) / rate, (nz * vx - nx * vz) / rate, (nx * vy - ny * vx) / rate
    cx, cy, cz = (vx - along * nx) / rate, (vy - along * ny) / rate, (vz - along * nz) / rate
    for i in range(np.uint64(points.shape[0])):
        t = times[i] - reference
        a = rate * t
        a -= TURN * np.floor(a / TURN + 0.5)
        q = a * a
        sine, versine = 1.0, 1.0
        for k in range(TERMS, 0, -1):
            sine = 1.0 - q / (2 * k * (2 * k + 1)) * sine
            versine = 1.0 - q / ((2 * k + 1) * (2 * k + 2)) * versine
        sine *= a
        versine *= 0.5 * q
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        px, py, pz = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
        forth = along * t
        undone[i, 0] = x + sine * (px + cx) + versine * (ny * pz - nz * py + bx) + forth * nx
        undone[i, 1] = y + sine * (py + cy) + versine * (nz * px - nx * pz + by) + forth * ny
        undone[i, 2] = z + sine * (pz + cz) + versine * (nx * py - ny * px + bz) + forth * nz


def moved_in_time(
    points: Points, times: Floats, motions: Transforms, begin: float, end: float
) -> Points:
    """Return points (N, 3), each moved by the motion of its time.

    Args:
        points: (N, 3).
        times: (N,).
        motions: (S, 4, 4), S >= 2, at times from `begin` to `end` in equal steps; between two the
            entries are linear, which is off by a 2 eighths where a is the angle between them.
        begin, end: of the table.
    """
    moved = np.empty_like(points)
    step = (end - begin) / (len(motions) - 1)
    _move(points, times, np.ascontiguousarray(motions[:, :3]), begin, step, moved)
    return moved


@kernel
def _move(
    points: Points, times: Floats, motions: Floats, begin: float, step: float, moved: Points
) -> None:
    last = motions.shape[0] - 2
    for i in range(points.shape[0]):
        at = (times[i] - begin) / step
        k = min(max(int(at), 0), last)
        after = at - k
        before = 1.0 - after
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for row in range(3):
            a = before * motions[k, row, 0] + after * motions[k + 1, row, 0]
            b = before * motions[k, row, 1] + after * motions[k + 1, row, 1]
            c = before * motions[k, row, 2] + after * motions[k + 1, row, 2]
            t = before * motions[k, row, 3] + after * motions[k + 1, row, 3]
            moved[i, row] = a * x + b * y + c * z + t
