"""A voxel size that suits two clouds, or more: from spacing, thickness of surfaces, and extent.

Each cloud is looked at once, at the sizes of one ladder, 2^(k/2) of its unit of length: how many
voxels it fills, and down to which size balls of voxels hold surfaces. Clouds take the finest
size that suits all. The steps are coarse, so that the scans of a sensor, and a map that they are
registered to, share a size.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from idem_ros.core.arrays import (
    Floats,
    Indices,
    Integers,
    Integers32,
    Mask,
    Point,
    Points,
    Weights,
)
from idem_ros.core.config import AUTO, VOXEL_SIZES, RegistrationConfig
from idem_ros.core.geometry.grid import bounds
from idem_ros.core.geometry.symmetric3 import scaled, thinnest_axis
from idem_ros.core.geometry.voxels import reduce_to_voxels, voxel_of
from idem_ros.core.jit import kernel
from idem_ros.core.metric.moments import AS_MEASURED
from idem_ros.core.metric.noise import LEAST_MEMBERS, sheet_variance
from idem_ros.core.tuning import SOLVER, SolverTuning

if TYPE_CHECKING:
    from idem_ros.core.metric.cloud import Cloud


PER_OCTAVE = 2
# Steps: a ball among voxels reaches as far as a cube of twice their edge, but holds most of its
# points nearer to the middle, where it may be one ring.
BALL, CORE = 2, 1
# What noise makes of a ring, along its rays, is flat and has no thickness: a fan. A surface is one
# in the cube twice as wide, too, where that of a fan is a line, or a surface across it.
DOUBLE, ALIKE = 2, 0.7  # steps; least cosine between the two normals
MANY = 10  # points that show whether they are a line
LEAST_CUBES = 30  # fewer say nothing of a cloud
ALONE = 2 / 3  # of the points: voxels that are as many hold one point each
SAMPLE = 8_000  # points, about, in cubes that are looked at whole
CUBES, LEAST_SAMPLED = 400, 48  # of them in the cloud, at least, and of those looked at
COARSE_SAMPLE = 4_096  # points that tell how many there are
WIDENINGS = 8  # steps coarser than that, where balls still hold lines
MOST_STEPS = 26  # down the ladder: of copies voxels never become as many as points


class _Cubes(NamedTuple):
    """The M cubes of a step that points fill, and the surface in each."""

    mean: Points  # (M, 3) of the points
    members: Floats  # (M,)
    thickness: Floats  # (M,): of the surface; -1: there is none
    normal: Points  # (M, 3)


class Fit(NamedTuple):
    """How a cloud fills voxels, from a coarse size down to the finest that suits it."""

    points: int
    coarsest: int  # step of the ladder, see `edge`
    voxels: tuple[int, ...]  # estimates: at the coarsest, at the next finer, ...

    @property
    def finest(self) -> int:
        """Step of the finest size from which on balls hold surfaces, thin against them."""
        return self.coarsest - len(self.voxels) + 1


def with_voxel_size(
    config: RegistrationConfig, *clouds: Cloud, tuning: SolverTuning = SOLVER
) -> RegistrationConfig:
    """Return a `RegistrationConfig` whose voxel size is a number or None, never `AUTO`.

    Args:
        config: `RegistrationConfig`.
        clouds: `Cloud`s; in any order they are given the same size.
        tuning: `SolverTuning`.
    """
    if config.voxel_size != AUTO:
        return config
    fits = (cloud.voxel_fit(tuning) for cloud in clouds)
    return _with(config, common_voxel_size(*fits, tuning=tuning))


def with_voxel_size_of(
    config: RegistrationConfig, scan: Cloud, tuning: SolverTuning = SOLVER
) -> RegistrationConfig:
    """Return the same for a scan in a map: the finest size that suits the scan.

    Of the map only a part is looked at, another for each scan; so its own fit is not asked for.
    """
    if config.voxel_size != AUTO:
        return config
    fit = scan.voxel_fit(tuning)
    of_map = fit and fit._replace(points=max(fit.points, int(tuning.few_points)))
    return _with(config, common_voxel_size(fit, of_map, tuning=tuning))


def _with(config: RegistrationConfig, size: float | None) -> RegistrationConfig:
    low, high = VOXEL_SIZES
    return replace(config, voxel_size=size if size and low <= size <= high else None)


def size_found(config: RegistrationConfig) -> float | None:
    """Return the voxel size of what `with_voxel_size` returned; None: points as given."""
    size = config.voxel_size
    assert not isinstance(size, str), f'voxel_size is still {size!r}'
    return size


def common_voxel_size(*fits: Fit | None, tuning: SolverTuning = SOLVER) -> float | None:
    """Return the finest voxel size that suits all of the `Fit`s; None: points as given."""
    known = [fit for fit in fits if fit is not None]
    if len(known) < len(fits) or max(fit.points for fit in known) < tuning.few_points:
        return None
    begin, end = max(fit.finest for fit in known), min(fit.coarsest for fit in known)
    for step in range(begin, end):
        filled = sorted(fit.voxels[fit.coarsest - step] for fit in known)
        if filled[(len(filled) - 1) // 2] <= tuning.most_voxels:
            return edge(step)
    return edge(end)


def edge(step: int) -> float:
    """Return the edge of the voxels of a step of the ladder, in the clouds' unit."""
    return float(2.0 ** (step / PER_OCTAVE))


def fit_of(points: Points, tuning: SolverTuning = SOLVER) -> Fit | None:
    """Return the `Fit` of (N, 3) points about their middle; None: too few, or all in one place."""
    few = np.ascontiguousarray(points[:: max(len(points) // COARSE_SAMPLE, 1)])
    span = float(np.median(np.abs(few).max(axis=1)))
    if len(points) < LEAST_MEMBERS or span == 0.0:
        return None
    step = _cube(few, int(np.ceil(PER_OCTAVE * np.log2(span))))
    cubes = len(_filled(few, step))
    one_in = max(min(len(points) // SAMPLE, cubes // LEAST_SAMPLED), 1)
    some = _in_chosen(points, edge(step), one_in)
    sampled = points[some] if one_in > 1 and len(some) else points
    distinct = len(np.unique(np.ascontiguousarray(sampled).view('V24')))  # copies add nothing
    least = min(int(tuning.least_voxels), len(points) * distinct // (2 * len(sampled)))
    limits = least, ALONE * distinct
    coarsest, voxels = _down_the_ladder(sampled, step, one_in, limits, tuning)
    return Fit(len(points), coarsest, voxels)


def _down_the_ladder(
    sampled: Points, step: int, one_in: int, limits: tuple[int, float], tuning: SolverTuning
) -> tuple[int, tuple[int, ...]]:
    """Return the coarsest step that is of use, and how many voxels there are, by finer steps.

    By points in one of so many cubes, from a step that is coarse enough. The limits: least voxels
    of the coarsest, which gives way to the next coarser one where it does not suit; most of these
    points that the finest fills.
    """
    least, most = limits
    low, widest = bounds(sampled)[0], WIDENINGS + BALL + DOUBLE
    cubes = {k: _cubes(sampled, k) for k in range(step, step + widest + 1)}
    while one_in * len(cubes[step].mean) < least and len(cubes) < MOST_STEPS:
        step -= 1
        cubes[step] = _cubes(sampled, step)
    wider = range(step, step + WIDENINGS + 1)
    coarsest = next((k for k in wider if _suits(cubes, k, low, tuning)), step)
    voxels, step = [one_in * len(cubes[coarsest].mean)], coarsest - 1
    while coarsest not in wider[1:] and len(cubes) < MOST_STEPS:
        cubes[step] = _cubes(sampled, step)
        if len(cubes[step].mean) > most or not _suits(cubes, step, low, tuning):
            break
        voxels.append(one_in * len(cubes[step].mean))
        step -= 1
    return coarsest, tuple(voxels)


def _cube(few: Points, step: int) -> int:
    """Return the step at which a sample of points fills some hundreds of cubes."""
    for finer in range(step, step - MOST_STEPS, -1):
        if len(_filled(few, finer)) >= min(CUBES, len(few) // 3):
            return finer
    return step


def _cubes(points: Points, step: int) -> _Cubes:
    """Return the `_Cubes` of a step that points fill."""
    mean, weights = reduce_to_voxels(points, AS_MEASURED, edge(step))
    return _Cubes(mean, np.ascontiguousarray(weights[:, 0]), *_shapes(weights))


def _filled(points: Points, step: int) -> Points:
    """Return the means, (M, 3), of the points in the cubes of a step that they fill."""
    return reduce_to_voxels(points, AS_MEASURED, edge(step)).mean


def _suits(cubes: dict[int, _Cubes], step: int, low: Point, tuning: SolverTuning) -> bool:
    """Whether the cubes of each step hold thin surfaces; unknown: yes.

    low: (3,) corner of all of them.
    """
    balls, core = cubes[step + BALL], cubes[step + CORE]
    surfaces = _are_surfaces(cubes, step + BALL, low)
    thickness = balls.thickness[surfaces]
    if len(thickness) >= LEAST_CUBES:
        quartile = np.partition(thickness, len(thickness) // 4)[len(thickness) // 4]
        if quartile > tuning.most_thickness * edge(step):
            return False
    many = core.members >= MANY
    if many.sum() >= LEAST_CUBES:
        if (core.thickness[many] >= 0.0).mean() < tuning.least_surfaces:
            return False
        surfaces = _are_surfaces(cubes, step + CORE, low)[many]
    else:
        surfaces = surfaces[balls.members >= LEAST_MEMBERS]
    return len(surfaces) < LEAST_CUBES or bool(surfaces.mean() >= tuning.least_sure)


def _are_surfaces(cubes: dict[int, _Cubes], step: int, low: Point) -> Mask:
    """Return which cubes of a step, (M,), hold a surface that those twice as wide hold, too."""
    each, wider = cubes[step], cubes[step + DOUBLE]
    room = len(each.mean) + len(wider.mean)
    table = np.full(1 << (2 * room - 1).bit_length(), -1, np.int32), np.empty((room, 3), np.int64)
    which = _within(wider.mean, each.mean, low, edge(step + DOUBLE), table)
    alike = np.abs(np.einsum('ij,ij->i', each.normal, wider.normal[which])) > ALIKE
    found: Mask = (each.thickness >= 0.0) & (wider.thickness[which] >= 0.0) & alike
    return found


@kernel
def _in_chosen(points: Points, size: float, one_in: int) -> Indices:
    """Return the indices of the points in every `one_in`-th cube, by a hash of its place."""
    found, n = np.empty(len(points), np.int64), 0
    for i in range(len(points)):
        h = np.int64(0)
        for c in range(3):
            h = (h ^ np.int64(np.floor(points[i, c] / size))) * 0x5851F42D4C957F2D
            h ^= (h >> 29) & 0x7FFFFFFFF
        found[n] = i  # kept only if it is counted
        n += (h & 0x7FFFFFFF) % one_in == 0
    return found[:n].copy()


@kernel
def _within(
    wider: Points,
    places: Points,
    low: Point,
    size: float,
    table: tuple[Integers32, Integers],
) -> Integers:
    """Return which of the wider cubes, by their means, each place (N, 3) lies in.

    table: room for the slots and the corners of both.
    """
    slots, corners = table
    found, mask = np.empty(len(places), np.int64), slots.shape[0] - 1
    for i in range(len(wider) + len(places)):
        p = wider[i] if i < len(wider) else places[i - len(wider)]
        x, y, z = p[0] - low[0], p[1] - low[1], p[2] - low[2]
        n = min(i, len(wider))
        v = voxel_of(
            np.int64(x / size), np.int64(y / size), np.int64(z / size), slots, mask, corners, n
        )
        if i >= len(wider):
            found[i - len(wider)] = v if v < len(wider) else 0  # rounded off its cube: any
    return found


@kernel
def _shapes(weights: Weights) -> tuple[Floats, Points]:
    """Return thickness (M,) and normal (M, 3) of the surface in each cube; -1: there is none.

    Weights (M, 7) are weight and scatter of cubes.
    """
    thickness, normal = np.full(len(weights), -1.0), np.zeros((len(weights), 3))
    for i in range(len(weights)):
        k = weights[i, 0]
        if k < LEAST_MEMBERS:
            continue
        xx, xy, xz = weights[i, 1], weights[i, 2], weights[i, 3]
        s = scaled((xx, xy, xz, weights[i, 4], weights[i, 5], weights[i, 6]), 1.0 / k)
        square = sheet_variance(s, k)
        if square >= 0.0:
            thickness[i] = np.sqrt(square)
            normal[i, 0], normal[i, 1], normal[i, 2] = thinnest_axis(s)
    return thickness, normal
