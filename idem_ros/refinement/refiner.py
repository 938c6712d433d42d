"""The one path from a pair of messages to a refined transform, for the node and for replay."""

from dataclasses import dataclass, replace
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import (
    Cloud,
    IdemError,
    RegistrationConfig,
    RegistrationResult,
    Status,
    q_tot,
    register,
)
from idem_ros.messages.pointcloud2 import PointsRead, read_points
from idem_ros.pairing.targets import LEAST_POINTS, UnusableTarget
from idem_ros.refinement.preprocessing import Preprocessed, PreprocessingConfig, preprocess


class StageTimes(NamedTuple):
    """What the stages of a refinement took [ms]; a target that was kept costs nothing."""

    reading: float = 0.0
    preparing: float = 0.0
    registering: float = 0.0
    judging: float = 0.0


@dataclass(frozen=True)
class Refinement:
    """What became of one pair."""

    stamp: int
    """The source's [ns]."""
    target_frame: str
    source_frame: str
    T_guess: NDArray
    """(4, 4), source in target frame, as it was given."""
    result: RegistrationResult
    q_tot_before: float | None
    """q_tot at the guess, at the radius of `result.q_tot` [nat]; None: not asked for."""
    time_ms: float
    """Reading the messages and registering; without `q_tot_before`."""
    points_target: int
    """Points that took part; so `points_source`."""
    points_source: int
    dropped_nonfinite: int
    """Points left out of both clouds because they are not finite."""
    dropped_zero: int
    """Points left out of both clouds because they are exactly zero."""
    cropped: int = 0
    """Points left out of both clouds by the range limits and the crop box."""
    thinned: int = 0
    """Points left out of both clouds for `max_points`."""
    times: StageTimes = StageTimes()


@dataclass(frozen=True)
class PreparedCloud:
    """A cloud as it was read, what of it takes part, and that prepared."""

    read: PointsRead
    preprocessed: Preprocessed
    cloud: Cloud
    reading_ms: float
    preparing_ms: float


class TookPart(NamedTuple):
    """What the last refinement was made of."""

    target: Cloud
    source: Cloud
    config: RegistrationConfig


class Idem:
    """What registers two clouds: IDEM. Others that a `Refiner` takes have the same methods."""

    def register(self, target, source, T_guess, config):
        """Register two `Cloud`s, see `core.register`."""
        return register(target, source, T_guess, config)

    def judged(self, result, target, source, config):
        """Return a result with the figures of the metric in it, outside of the measured time."""
        return result


class Refiner:
    """Refines pairs; a target that stays the same message is read and prepared once.

    A pair whose guess is the last result starts from the last usable one between the same frames;
    where there is none since the guess's `start`, or the clock was set back, from its `T_first`.

    Args:
        config: `RegistrationConfig`; None: its defaults.
        judge_guess: whether q_tot is evaluated at the guess, too.
        preprocessing: `PreprocessingConfig`; None: its defaults.
        method: what registers, see `Idem`; None: that.

    Attributes:
        took_part: `TookPart` of the last refinement; None before.
    """

    def __init__(self, config=None, judge_guess=False, preprocessing=None, method=None):
        self._judge_guess = judge_guess
        self._method = method or Idem()
        self._target_of = self._target = self.took_part = None
        self._last = None, None
        self.configure(config or RegistrationConfig(), preprocessing or PreprocessingConfig())

    def configure(self, config, preprocessing):
        """Take other parameters from the next refinement on; may be called from any thread."""
        self._configs = config, preprocessing  # one assignment: never one old and one new

    def refine(self, pair):
        """Register the source of a `Pair` to its target, from its guess.

        Returns:
            `Refinement`; whether it converged is its `result.status`.

        Raises:
            UnusableTarget: the target cannot be used, but another might.
            IdemError: a cloud cannot be used; the message says which and why.
        """
        watch, kept = Stopwatch(), self._target
        config, preprocessing = self._configs
        frames = _frames_of(pair)
        T_guess = self._guess_of(pair, frames)
        target = self._prepared_target(pair.target, preprocessing)
        source = prepared('source', pair.source, preprocessing)
        clouds = target.cloud, source.cloud
        preparing_ms = watch.lap()
        found = self._method.register(*clouds, T_guess, config)
        registering_ms = watch.lap()
        config = replace(config, voxel_size=found.voxel_size)  # what "auto" was
        result = self._method.judged(found, *clouds, config)
        judged = q_tot_at(T_guess, *clouds, result.radius, config) if self._judge_guess else None
        self.took_part = TookPart(*clouds, config)
        self._last = self._last_after(pair, frames, result)
        fresh = [each for each in (target, source) if each is not kept]
        refinement = Refinement(
            stamp=pair.stamp,
            target_frame=frames[0],
            source_frame=frames[1],
            T_guess=T_guess,
            result=result,
            q_tot_before=judged,
            time_ms=preparing_ms + registering_ms,
            **_counts(target, source),
            times=StageTimes(
                reading=sum(each.reading_ms for each in fresh),
                preparing=sum(each.preparing_ms for each in fresh),
                registering=registering_ms,
                judging=watch.lap(),
            ),
        )
        _require_enough(target.cloud, config, refinement)
        return refinement

    def _guess_of(self, pair, frames) -> NDArray:
        if pair.guess.T_target_source is not None:
            return pair.guess.T_target_source
        last_of, last = self._last
        if last_of == _lineage(pair, frames):
            return last
        return np.eye(4) if pair.guess.T_first is None else pair.guess.T_first

    def _last_after(self, pair, frames, result):
        if not result.is_usable:
            return self._last
        return _lineage(pair, frames), result.T_target_source

    def _prepared_target(self, message, preprocessing) -> PreparedCloud:
        kept_of = self._target_of
        if not kept_of or message is not kept_of[0] or preprocessing != kept_of[1]:
            try:
                self._target = prepared('target', message, preprocessing)
            except IdemError as error:
                raise UnusableTarget(str(error)) from error
            self._target_of = message, preprocessing
        return self._target


def _require_enough(target, config, refinement):
    """Refuse a target of which nothing could be evaluated, with what came of it all the same."""
    if refinement.result.radius > 0.0 or refinement.result.status is Status.NO_OVERLAP:
        return
    size, why = config.voxel_size, ''
    points = target if size is None else target.reduced(size)
    if len(points) < LEAST_POINTS:
        of_what = 'points take part' if size is None else f'voxels of {size:g} m are left'
        why = f'{len(points)} {of_what}; {LEAST_POINTS} are needed'
    elif not np.ptp(points.points, axis=0).any():
        why = f'all of its {len(points)} points are in one place'
    if why:
        raise UnusableTarget(f'target: {why}', refinement)


def _frames_of(pair):
    frames = (
        pair.target.header.frame_id or pair.guess.target_frame,
        pair.source.header.frame_id or pair.guess.source_frame,
    )
    return tuple(frame.lstrip('/') for frame in frames)  # of ROS 1, where it meant nothing


def _lineage(pair, frames):
    """Return what a pair and the last result share, where the pair may start from it."""
    return frames, pair.jumps, pair.guess.start


def _counts(target, source):
    """Return the points of both clouds that take part, and those that do not and why."""
    inputs = target, source
    return {
        'points_target': len(target.preprocessed.points),
        'points_source': len(source.preprocessed.points),
        'dropped_nonfinite': sum(each.read.dropped_nonfinite for each in inputs),
        'dropped_zero': sum(each.read.dropped_zero for each in inputs),
        'cropped': sum(each.preprocessed.cropped for each in inputs),
        'thinned': sum(each.preprocessed.thinned for each in inputs),
    }


def prepared(role, message, preprocessing) -> PreparedCloud:
    """Read a PointCloud2 and prepare what of it takes part.

    Args:
        role: 'target' or 'source', which errors name.
        message: see `read_points`.
        preprocessing: `PreprocessingConfig`.

    Raises:
        IdemError: it cannot be read, or no point takes part.
    """
    watch = Stopwatch()
    read = _named(role, read_points, message)
    reading_ms = watch.lap()
    is_target = role == 'target'
    kept = _named(role, lambda points: preprocess(points, preprocessing, is_target), read.points)
    cloud = _named(role, Cloud, kept.points)
    return PreparedCloud(read, kept, cloud, reading_ms, watch.lap())


class Stopwatch:
    """Times stages one after the other."""

    def __init__(self):
        self._since = perf_counter_ns()

    def lap(self) -> float:
        """Return the time since it was made, or since the last lap [ms]."""
        before, self._since = self._since, perf_counter_ns()
        return (self._since - before) / 1e6


def q_tot_at(T_target_source, target, source, radius, config):
    """Return q_tot [nat] of two `Cloud`s somewhere, comparable with a result of this radius."""
    if radius == 0.0:  # too few points, or all in one place: nothing was evaluated
        return 0.0
    voxel_size = config.voxel_size
    if voxel_size is not None:  # the clouds that the result's q_tot is of
        target, source = target.reduced(voxel_size), source.reduced(voxel_size)
    scale = config.length_scale
    return q_tot(target, source, T_target_source, radius=radius, length_scale=scale)


def _named(role, read, given):
    """Read one of the inputs; let its error say which it was."""
    try:
        return read(given)
    except IdemError as error:
        raise type(error)(f'{role}: {error}') from error
