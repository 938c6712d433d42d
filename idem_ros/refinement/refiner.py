"""The one path from a pair of messages to a refined transform, for the node and for replay."""

from dataclasses import replace
from typing import Any

import numpy as np

from idem_ros.core import (
    Cloud,
    MapCloud,
    RegistrationConfig,
    Status,
    q_tot,
    register,
)
from idem_ros.core.config import AUTO
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.core.maps.target import in_reach
from idem_ros.pairing.targets import LEAST_POINTS, UnusableTarget
from idem_ros.refinement.last_results import LastResults
from idem_ros.refinement.outcome import Refinement, StageTimes, TookPart
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.prepared_cloud import (
    PreparedTargets,
    Stopwatch,
    left_out,
    on_the_ground,
    prepare_ahead,
    prepared,
)
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.sweep_motion import Asked, SweepMotion
from idem_ros.refinement.times_said import TimesSaid
from idem_ros.refinement.undoing import Undoing, undoing_of, undone


class Idem:
    """What registers two clouds: IDEM. Others that a `Refiner` takes have the same methods."""

    solves_motion = True

    def register(self, target, source, T_guess, config, twist=None, covariance=None):
        """Register two `Cloud`s, see `core.register`; covariance: of the guess."""
        return register(target, source, T_guess, config, twist=twist, guess_covariance=covariance)

    def judged(self, result, target, source, config):
        """Return a result with the figures of the metric in it, outside of the measured time."""
        return result


class Refiner:
    """Refines pairs; a target that stays the same message is read and prepared once.

    A pair whose guess is the last result starts where the `LastResults` between the same frames
    lead; where there is none since the guess's `start`, or the clock was set back, from its
    `T_first`.

    Args:
        config: `RegistrationConfig`; None: its defaults.
        judge_guess: whether q_tot is evaluated at the guess, too.
        preprocessing: `PreprocessingConfig`; None: its defaults.
        method: what registers, see `Idem`; None: that.
        point_times: `PointTimeConfig`; None: its defaults.

    Attributes:
        times_said: `TimesSaid` of the clouds so far.
    """

    def __init__(
        self, config=None, judge_guess=False, preprocessing=None, method=None, point_times=None
    ):
        self._judge_guess = judge_guess
        self._method = method or Idem()
        self._targets = PreparedTargets()
        self._last = LastResults()
        self._before = None  # the last source, and where it was found
        self._undone_target: Any = None, '', None
        self._motion = SweepMotion()
        self.times_said = TimesSaid()
        preprocessing = preprocessing or PreprocessingConfig()
        self.configure(config or RegistrationConfig(), preprocessing, point_times)

    def configure(self, config, preprocessing, point_times=None):
        """Take other parameters from the next refinement on; may be called from any thread."""
        # one assignment: never some old and some new
        self._configs = config, (preprocessing, point_times or PointTimeConfig())

    def refine(self, pair):
        """Register the source of a `Pair` to its target, from its guess.

        Returns:
            `Refinement`; whether it converged is its `result.status`.

        Raises:
            UnusableTarget: the target cannot be used, but another might.
            IdemError: a cloud cannot be used; the message says which and why.
        """
        watch, kept = Stopwatch(), self._targets.kept
        config, of_clouds = self._configs
        frames = _frames_of(pair)
        target = self._targets.of(pair.target, of_clouds)
        source = prepared('source', pair.source, *of_clouds)
        T_guess = self._guess_of(pair, frames, target.cloud, source.cloud)
        step = self._motion.step_of(pair, target.times is not None)
        asked = Asked(pair, T_guess, _lineage(pair, frames), step)
        # to what is smeared a motion would fit that makes up for it
        is_smeared = target.times is None and self._motion.is_smeared(pair.target)
        undoing = self._undoing(asked, source.cloud, config, not is_smeared)
        target_cloud = self._target_cloud(asked, target, undoing, config)
        preparing_ms = watch.lap()
        fresh = [each for each in (target, source) if not any(each is other for other in kept)]
        refinement = registered(
            self._method,
            target_cloud,
            undoing,
            self._judge_guess,
            pair.guess.covariance,
            stamp=pair.stamp,
            target_frame=frames[0],
            source_frame=frames[1],
            time_ms=preparing_ms,
            points_target=len(target),
            points_source=len(source.preprocessed.points),
            **left_out(target, source),
            times=StageTimes(
                reading=sum(each.reading_ms for each in fresh),
                preparing=sum(each.preparing_ms for each in fresh),
            ),
            point_times=self._times_news(target, source),
        )
        return self._concluded(asked, target_cloud, undoing, refinement)

    def _concluded(self, asked, target_cloud, undoing, refinement):
        """Take note of what was found, for what comes next."""
        result, T = refinement.result, refinement.result.T_target_source
        self._motion.keep(asked, undoing, result)
        lost = self._last.keep(asked.pair, asked.of, result)
        self._before = undoing.source, T
        _require_enough(refinement)
        if isinstance(target_cloud, MapCloud):
            refinement = replace(refinement, points_target=len(refinement.took_part.target))
            map_ = getattr(asked.pair.target, 'map', None)
            prepare_ahead(target_cloud, map_, undoing.source, T, self._last.ahead_of(T))
        return replace(refinement, lost=lost)

    def prepare(self, target):
        """Read and prepare a target that comes next, around the last source; from any thread.

        Raises:
            UnusableTarget: it cannot be used.
        """
        config, of_clouds = self._configs
        target, before = self._targets.of(target, of_clouds), self._before
        if isinstance(target.cloud, MapCloud) and before is not None:
            # what scans reach of a map is prepared when one is registered to it
            register(target.cloud, *before, replace(config, motion='none'))

    def expect(self, target):
        """Read and prepare a scan that may be the next target; one after each refinement.

        Raises:
            UnusableTarget: it cannot be used.
        """
        config, of_clouds = self._configs
        expected = self._targets.expect(target, of_clouds)
        if isinstance(expected, Cloud) and config.motion == 'none':
            if config.voxel_size == AUTO:
                expected.voxel_fit()
            elif config.voxel_size is not None:
                expected.reduced(config.voxel_size)

    def _guess_of(self, pair, frames, target, source):
        T = self._last.guess_for(pair, _lineage(pair, frames))
        has_height = T is not pair.guess.T_first or T[2, 3] != 0.0
        if has_height or not isinstance(target, MapCloud):
            return T
        return on_the_ground(target, source, T)

    def _times_news(self, target, source):
        said = {'target': target.read.times, 'source': source.read.times}
        return self.times_said.news(**said, imu=self._motion.imu_said)

    def _undoing(self, asked, source, config, solves) -> Undoing:
        def find(begin, end):
            return self._motion.track(config.motion, asked, begin, end)

        solves = solves and self._method.solves_motion
        given = source, asked.T_guess, config, find, solves
        return undoing_of(*given, self._motion.middle)

    def _target_cloud(self, asked, target, undoing, config) -> Cloud | MapCloud:
        """Return what a target is; a scan is undone by what was found of its sweep."""
        times, at = target.times, config.motion_reference
        if config.motion == 'none' or times is None:
            return self._targets.cloud_for(target, undoing.source, asked.of[0])
        of, reference, _ = self._undone_target
        if of is not target or reference != at:
            middle, reference = (reference_time(times, each) for each in ('middle', at))
            track = self._motion.of_target(asked, middle, reference, undoing.track)
            cloud = target.cloud if track is None else undone(target.cloud, track, reference)
            self._undone_target = target, at, cloud
        return self._undone_target[2]


def registered(method, target, undoing, judge_guess=True, covariance=None, **known) -> Refinement:
    """Register a source to a target and judge what comes of it.

    Args:
        method: see `Idem`.
        target: `Cloud` or `MapCloud`.
        undoing: `Undoing` of the source.
        judge_guess: whether q_tot is evaluated at the guess, too.
        covariance: (6, 6) of the guess; None: it does not say.
        known: of the other fields of a `Refinement`; `time_ms` and `times` of what was before.
    """
    watch = Stopwatch()
    clouds, T_guess = (target, undoing.source), undoing.T_guess
    found = method.register(*clouds, T_guess, undoing.config, undoing.twist, covariance)
    registering_ms = watch.lap()
    config = replace(undoing.config, voxel_size=found.voxel_size)  # what "auto" was
    met = in_reach(*clouds, found.T_target_source, config), clouds[1]
    result = method.judged(found, *met, config)
    before = q_tot_at(T_guess, *clouds, result.radius, config) if judge_guess else None
    times = known.pop('times', StageTimes())
    refinement = Refinement(
        T_guess=T_guess,
        result=result,
        q_tot_before=before,
        time_ms=known.pop('time_ms') + registering_ms,
        times=times._replace(registering=registering_ms, judging=watch.lap()),
        took_part=TookPart(*met, config),
        **known,
    )
    return undoing.told(refinement)


def _require_enough(refinement):
    """Refuse a target of which nothing could be evaluated, with what came of it all the same."""
    target, _, config = refinement.took_part
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


def q_tot_at(T_target_source, target, source, radius, config):
    """Return q_tot [nat] of two clouds somewhere, comparable with a result of this radius."""
    if radius == 0.0:  # too few points, or all in one place: nothing was evaluated
        return 0.0
    target = in_reach(target, source, T_target_source, config)
    voxel_size = config.voxel_size
    if voxel_size is not None:  # the clouds that the result's q_tot is of
        target, source = target.reduced(voxel_size), source.reduced(voxel_size)
    scale = config.length_scale
    return q_tot(target, source, T_target_source, radius=radius, length_scale=scale)
