"""The one path from a pair of messages to a refined transform, for the node and for replay."""

from dataclasses import dataclass
from time import perf_counter_ns

from numpy.typing import NDArray

from idem_ros.core import (
    Cloud,
    IdemError,
    RegistrationConfig,
    RegistrationResult,
    q_tot,
    register,
)
from idem_ros.pointcloud2 import PointsRead, read_points
from idem_ros.transform_message import matrix_of


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
    points_source: int
    dropped_nonfinite: int
    """Points left out of both clouds because they are not finite."""
    dropped_zero: int
    """Points left out of both clouds because they are exactly zero."""


class Refiner:
    """Refines pairs; a target that stays the same message is read and prepared once.

    Args:
        config: `RegistrationConfig`; None: its defaults.
        judge_guess: whether q_tot is evaluated at the guess, too.
    """

    def __init__(self, config=None, judge_guess=False):
        self._config = RegistrationConfig() if config is None else config
        self._judge_guess = judge_guess
        self._target_message = None
        self._target = None
        self._target_read = None

    def refine(self, pair):
        """Register the source of a `Pair` to its target, from its guess.

        Returns:
            `Refinement`; whether it converged is its `result.status`.

        Raises:
            IdemError: a cloud or the guess cannot be used; the message says which and why.
        """
        start = perf_counter_ns()
        T_guess = _named('initial guess', matrix_of, pair.guess)
        target, target_read = self._prepared_target(pair.target)
        source_read = _named('source', read_points, pair.source)
        source = Cloud(source_read.points)
        result = register(target, source, T_guess, self._config)
        time_ms = (perf_counter_ns() - start) / 1e6
        judged = (
            self._q_tot_at(T_guess, target, source, result.radius) if self._judge_guess else None
        )
        return Refinement(
            stamp=pair.stamp,
            target_frame=pair.target.header.frame_id or pair.guess.header.frame_id,
            source_frame=pair.source.header.frame_id or pair.guess.child_frame_id,
            T_guess=T_guess,
            result=result,
            q_tot_before=judged,
            time_ms=time_ms,
            points_target=len(target_read.points),
            points_source=len(source_read.points),
            dropped_nonfinite=target_read.dropped_nonfinite + source_read.dropped_nonfinite,
            dropped_zero=target_read.dropped_zero + source_read.dropped_zero,
        )

    def _prepared_target(self, message) -> tuple[Cloud, PointsRead]:
        if message is not self._target_message:
            read = _named('target', read_points, message)
            self._target, self._target_read = Cloud(read.points), read
            self._target_message = message
        return self._target, self._target_read

    def _q_tot_at(self, T_target_source, target, source, radius):
        if radius == 0.0:  # too few points, or all in one place: nothing was evaluated
            return 0.0
        voxel_size = self._config.voxel_size
        if voxel_size is not None:  # the clouds that the result's q_tot is of
            target, source = target.reduced(voxel_size), source.reduced(voxel_size)
        scale = self._config.length_scale
        return q_tot(target, source, T_target_source, radius=radius, length_scale=scale)


def _named(role, read, message):
    """Call a reader of a message; let its error say which input it was."""
    try:
        return read(message)
    except IdemError as error:
        raise type(error)(f'{role}: {error}') from error
