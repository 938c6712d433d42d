"""Two clouds prepared to be registered: voxels, the radius of Eq. 9, and the stages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from idem_ros.core.arrays import MomentRows, Transform
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.entropy import TWO_PI_E_CUBED, length_unit
from idem_ros.core.metric.measured_points import require_resolved
from idem_ros.core.metric.noise import widening
from idem_ros.core.metric.radii import (
    last_radius,
    rounded,
    uncrowded,
    wide_radius,
    widest_useful,
)
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.solve.ball_cost import NOISE, BallCost
from idem_ros.core.solve.cost import JointEntropy, NormalBalance
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.trust_tuning import TrustTuning
from idem_ros.core.tuning import SolverTuning
from idem_ros.core.workers import Workers, in_threads

COPIES = 1e-9  # of the extent: points as near as that are one
LEAST_POINTS = 5  # a point and its four neighbours


class Sampling(NamedTuple):
    """What differs between clouds of points as measured and clouds of voxels."""

    last_radius: float  # of what Eq. 9 gives
    apart: float  # of the radius: `SolverTuning.apart`
    jumps: bool  # whether the minimum jumps by single points
    curvature: float  # `SolverTuning.curvature`


class Stage(NamedTuple):
    """One minimisation."""

    radius: float
    voxel_size: float | None  # None: the clouds as they were prepared
    is_last: bool = False


class Pair(NamedTuple):
    """Two clouds, and the stages that they are registered in."""

    target: Cloud
    source: Cloud
    stages: tuple[Stage, ...]  # coarse to fine; none where nothing can be registered
    sampling: Sampling
    config: RegistrationConfig
    tuning: SolverTuning
    trust: TrustTuning
    workers: Workers
    sweep: Sweep | None = None  # in which the source was measured; None: as the sensor stood still

    @property
    def is_small(self) -> bool:
        """Whether a cloud has too few points to be registered."""
        return min(map(len, self.clouds)) < LEAST_POINTS

    @property
    def clouds(self) -> tuple[Cloud, Cloud]:
        """Target and source."""
        return self.target, self.source

    def swapped(self) -> Pair:
        """Return the pair with target and source exchanged."""
        return self._replace(target=self.source, source=self.target, sweep=None)

    def swept_as(self, sweep: Sweep | None, found: Sweep | None = None) -> Pair:
        """Return the pair with the `Sweep` its source was undone of; found: how far solved."""
        if sweep is None:
            return self
        sweep = sweep.of_undone(self.source)
        return self._replace(sweep=sweep._replace(twist=found.twist) if found else sweep)

    def moved_by(self, sweep: Sweep | None) -> Pair:
        """Return the pair with the source as it lies by a sweep whose motion was solved."""
        if sweep is None or not sweep.is_solved:
            return self
        return self._replace(source=sweep.undone(), sweep=sweep)

    def around(self, T: Transform) -> Pair:
        """Return the pair with what of the target the source can meet at T."""
        radius = self.stages[-1].radius
        return self._replace(target=self.target.around(self.source, T, radius, self.workers))

    def balls(self, stage: Stage) -> Balls:
        """Return the `Balls` of a stage, on voxels as coarse as it is wide."""
        clouds = self.clouds
        if stage.voxel_size is not None:
            clouds = _reduced(clouds, stage.voxel_size, self.workers)
        return Balls(*clouds, stage.radius, self.workers)

    def wider_balls(self) -> Iterator[Balls]:
        """Yield the `Balls` of the stages before the last, those next to it first."""
        for stage in self.stages[-2::-1]:
            yield self.balls(stage)

    def cost(self, stage: Stage) -> JointEntropy:
        """Return the cost of a stage: `NormalBalance` in the last, `JointEntropy` before."""
        kind = NormalBalance if stage.is_last else JointEntropy
        balls = self.balls(stage)
        return kind(balls, self.ball_cost(balls, stage.is_last))

    def ball_cost(self, balls: Balls, tangential: bool) -> BallCost:
        """Return the `BallCost` of balls in a stage with the tangential weighting, or without."""
        scale = length_unit(self.config.length_scale, balls.radius)
        return BallCost(
            r2=balls.r2,
            c=TWO_PI_E_CUBED / scale**6,
            noise=(NOISE * balls.radius) ** 2,
            tangential=tangential,
            valued=False,
            apart2=(self.sampling.apart * balls.radius) ** 2,
            curvature=self._curvature(balls) if tangential else 1.0,
        )

    def _curvature(self, balls: Balls) -> float:
        """Return `SolverTuning.curvature`; 1 of samplings alike, which make up for each other."""
        most = self.sampling.curvature
        is_even = most == 1.0 or _are_alike(balls, self.tuning.spread_gap)
        return 1.0 if is_even else most


def prepare(
    target: Cloud,
    source: Cloud,
    config: RegistrationConfig,
    tuning: SolverTuning,
    trust: TrustTuning,
    workers: Workers,
) -> Pair:
    """Return the `Pair` of two clouds, as voxels where the configuration has a size; no stages."""
    clouds = target, source
    pair = Pair(*clouds, (), _sampling(clouds, tuning), config, tuning, trust, workers)
    voxel_size = size_found(config)
    if voxel_size is None or pair.is_small:
        return pair
    for cloud in clouds:
        require_resolved(cloud.points, voxel_size)
    clouds = _reduced(clouds, voxel_size, workers)
    return pair._replace(target=clouds[0], source=clouds[1], sampling=_sampling(clouds, tuning))


def with_stages(pair: Pair) -> Pair:
    """Return the `Pair` with its stages: by the radius of Eq. 9, that of the last fit for noise.

    It has none where a cloud has too few points, or all of them in one place.
    """
    config, tuning, workers = pair.config, pair.tuning, pair.workers
    if pair.is_small:
        return pair
    clouds = pair.clouds
    if wide_radius(*clouds, config.a, workers) == 0.0:
        clouds = _without_copies(clouds[0]), _without_copies(clouds[1])
        if min(map(len, clouds)) < LEAST_POINTS:
            return pair
    wide = wide_radius(*clouds, config.a, workers)  # Eq. 9
    radius = pair.sampling.last_radius * last_radius(*clouds, config.a, workers)
    radius = rounded(config.radius_schedule[-1] * radius)
    if radius == 0.0:
        return pair
    how = not pair.sampling.jumps, config.a * config.radius_schedule[-1]
    target, source = (uncrowded(cloud, radius, *how) for cloud in clouds)
    clouds = target, source  # copies have no thickness
    in_threads(workers, lambda cloud: cloud.thickness(radius), clouds)
    wider = widening(*clouds, radius, tuning)
    last = Stage(rounded(radius * wider), None, is_last=True)
    target, source = (uncrowded(cloud, last.radius, *how) for cloud in clouds)
    pair = pair._replace(target=target, source=source)
    return pair._replace(stages=(*_coarse_stages(pair, wide), last))


def wider_stage(pair: Pair) -> Stage | None:
    """Return a stage wider than the first; None where its balls would hold most of a cloud."""
    first, factor = pair.stages[0], pair.tuning.wider
    if factor * first.radius > widest_useful(*pair.clouds, pair.tuning.widest):
        return None
    assert first.voxel_size is not None, 'the first of one stage is the last'
    return Stage(factor * first.radius, factor * first.voxel_size)


def _coarse_stages(pair: Pair, wide: float) -> Iterator[Stage]:
    """Yield the stages before the last, but for those whose balls would hold most of a cloud."""
    widest = widest_useful(*pair.clouds, pair.tuning.widest)
    finest = size_found(pair.config) or 0.0
    for factor in pair.config.radius_schedule[:-1]:
        radius = rounded(factor * wide)
        if radius <= widest:
            yield Stage(radius, max(factor * finest, pair.tuning.spacing * radius))


def _sampling(clouds: Sequence[Cloud], tuning: SolverTuning) -> Sampling:
    if all(cloud.is_reduced for cloud in clouds):
        return Sampling(tuning.voxel_radius, tuning.apart, jumps=False, curvature=1.0)
    return Sampling(1.0, math.inf, jumps=True, curvature=tuning.curvature)


def _are_alike(balls: Balls, spread_gap: float) -> bool:
    """Whether points are spread about those of their own cloud alike."""
    spreads: list[float] = []
    for own in (cloud.own[cloud.own[:, 0] > 1.0] for cloud in balls.clouds):
        spreads.append(_spread(own) if len(own) else 0.0)
    return bool(abs(spreads[0] - spreads[1]) <= spread_gap * balls.r2)


def _spread(own: MomentRows) -> float:
    return float(np.mean((own[:, 4] + own[:, 7] + own[:, 9]) / own[:, 0]))


def _reduced(
    clouds: tuple[Cloud, Cloud], voxel_size: float, workers: Workers
) -> tuple[Cloud, Cloud]:
    target, source = in_threads(workers, lambda cloud: cloud.reduced(voxel_size), clouds)
    return target, source


def _without_copies(cloud: Cloud) -> Cloud:
    """Return a cloud with one point where points coincide; as it is, where all do."""
    edge = COPIES * float(np.ptp(cloud.points))
    return cloud.reduced(edge) if edge > 0.0 else cloud
