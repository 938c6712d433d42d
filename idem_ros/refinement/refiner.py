"""The one path from a pair of messages to a refined transform, for the node and for replay."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import (
    Cloud,
    IdemError,
    RegistrationConfig,
    Status,
    q_tot,
    register,
)
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.pairing.targets import LEAST_POINTS, UnusableTarget
from idem_ros.refinement.outcome import Refinement, StageTimes, TookPart
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.prepared_cloud import PreparedCloud, Stopwatch, left_out, prepared
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

    A pair whose guess is the last result starts from the last usable one between the same frames;
    where there is none since the guess's `start`, or the clock was set back, from its `T_first`.

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
        self._target_of = self._target = None
        self._last = None, None
        self._undone_target = None, '', None
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
        watch, kept = Stopwatch(), self._target
        config, of_clouds = self._configs
        frames = _frames_of(pair)
        T_guess = self._guess_of(pair, frames)
        target = self._prepared_target(pair.target, of_clouds)
        source = prepared('source', pair.source, *of_clouds)
        step = self._motion.step_of(pair, target.cloud.times is not None)
        asked = Asked(pair, T_guess, _lineage(pair, frames), step)
        undoing = self._undoing(asked, source.cloud, config)
        preparing_ms = watch.lap()
        fresh = [each for each in (target, source) if each is not kept]
        refinement = registered(
            self._method,
            self._target_cloud(asked, target, undoing, config),
            undoing,
            self._judge_guess,
            pair.guess.covariance,
            stamp=pair.stamp,
            target_frame=frames[0],
            source_frame=frames[1],
            time_ms=preparing_ms,
            points_target=len(target.preprocessed.points),
            points_source=len(source.preprocessed.points),
            **left_out(target, source),
            times=StageTimes(
                reading=sum(each.reading_ms for each in fresh),
                preparing=sum(each.preparing_ms for each in fresh),
            ),
            point_times=self._times_news(target, source),
        )
        self._last = self._last_after(pair, frames, refinement.result)
        self._motion.keep(asked, undoing, refinement.result)
        _require_enough(refinement)
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

    def _times_news(self, target, source):
        said = {'target': target.read.times, 'source': source.read.times}
        return self.times_said.news(**said, imu=self._motion.imu_said)

    def _undoing(self, asked, source, config) -> Undoing:
        def find(begin, end):
            return self._motion.track(config.motion, asked, begin, end)

        return undoing_of(source, asked.T_guess, config, find, self._method.solves_motion)

    def _target_cloud(self, asked, target, undoing, config) -> Cloud:
        """Return the cloud of a target; of a scan undone by what was found of its sweep."""
        times, at = target.cloud.times, config.motion_reference
        if config.motion == 'none' or times is None:
            return target.cloud
        of, reference, _ = self._undone_target
        if of is not target or reference != at:
            middle, reference = (reference_time(times, each) for each in ('middle', at))
            track = self._motion.of_target(asked, middle, reference, undoing.track)
            cloud = target.cloud if track is None else undone(target.cloud, track, reference)
            self._undone_target = target, at, cloud
        return self._undone_target[2]

    def _prepared_target(self, message, of_clouds) -> PreparedCloud:
        kept_of = self._target_of
        if not kept_of or message is not kept_of[0] or of_clouds != kept_of[1]:
            try:
                self._target = prepared('target', message, *of_clouds)
            except IdemError as error:
                raise UnusableTarget(str(error)) from error
            self._target_of = message, of_clouds
        return self._target


def registered(method, target, undoing, judge_guess=True, covariance=None, **known) -> Refinement:
    """Register a source to a target and judge what comes of it.

    Args:
        method: see `Idem`.
        target: `Cloud`.
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
    result = method.judged(found, *clouds, config)
    before = q_tot_at(T_guess, *clouds, result.radius, config) if judge_guess else None
    times = known.pop('times', StageTimes())
    refinement = Refinement(
        T_guess=T_guess,
        result=result,
        q_tot_before=before,
        time_ms=known.pop('time_ms') + registering_ms,
        times=times._replace(registering=registering_ms, judging=watch.lap()),
        took_part=TookPart(*clouds, config),
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
    """Return q_tot [nat] of two `Cloud`s somewhere, comparable with a result of this radius."""
    if radius == 0.0:  # too few points, or all in one place: nothing was evaluated
        return 0.0
    voxel_size = config.voxel_size
    if voxel_size is not None:  # the clouds that the result's q_tot is of
        target, source = target.reduced(voxel_size), source.reduced(voxel_size)
    scale = config.length_scale
    return q_tot(target, source, T_target_source, radius=radius, length_scale=scale)
