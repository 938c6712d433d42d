"""The motion of the sensor during a source's sweep undone, before or while it is registered."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, RegistrationConfig
from idem_ros.core.geometry.undistortion import reference_time
from idem_ros.refinement.sweep_motion import UnknownMotion
from idem_ros.refinement.track import Track

SAMPLE = 2000  # points, about, that tell how far they moved


@dataclass(frozen=True)
class Undoing:
    """What is registered of a source, and what is known of its motion."""

    source: Cloud
    """Undone, but where the motion is solved for."""
    T_guess: NDArray
    """(4, 4), at the reference."""
    config: RegistrationConfig
    """That registers it."""
    reference: float = 0.0
    """The instant that the pose is of, in seconds after the stamp."""
    twist: NDArray | None = None
    """(6,), that a solve starts from; None: none is solved for."""
    known: dict | None = None
    """What the result tells of the motion: its `twist`, `moved` and `motion_flaw`."""
    track: Track | None = None
    """What is undone, or a solve starts from."""
    middle: float = 0.0
    """Of the sweep, in seconds after the stamp: as its points say, or those of the one before."""

    def track_found(self, result):
        """Return the `Track` of the sweep after its registration; None: it is not known."""
        if self.twist is None:
            return self.track
        return None if result.twist is None else Track.of_twist(result.twist)

    def to_middle(self, result):
        """Return the middle of the sweep [s after the stamp], and the (4, 4) motion there.

        The motion is that from the pose of a result: of clouds that were not undone, or not well,
        the pose at the middle is right all the same, and so is the motion from one to the next.
        """
        middle, track = self.middle, self.track_found(result)
        return middle, np.eye(4) if track is None else track.step(self.reference, middle)

    def told(self, refinement):
        """Return a `Refinement` whose result tells the motion, and whose source is undone."""
        refinement = replace(refinement, reference=self.reference)
        if self.known is not None:
            return replace(refinement, result=replace(refinement.result, **self.known))
        twist = refinement.result.twist
        if twist is None:
            return refinement
        source = undone(self.source, Track.of_twist(twist), self.reference)
        took_part = refinement.took_part._replace(source=source)
        return replace(refinement, took_part=took_part)


def undoing_of(source, T_guess, config, find, solves=True, usual_middle=0.0):
    """Return the `Undoing` of a source.

    Args:
        source: `Cloud`.
        T_guess: (4, 4), its pose at the stamp.
        config: `RegistrationConfig`, whose `motion` says what is undone.
        find: returns its `Track`, given begin and end of its times [s]; raises `UnknownMotion`.
        solves: whether what registers can solve for a motion.
        usual_middle: of sweeps of its stream [s after the stamp], where its points have no times.
    """
    if config.motion == 'none':
        return Undoing(source, T_guess, config)
    still = replace(config, motion='none')
    if source.times is None:
        why = 'the source has no times of its points'
        return _not_undone(source, T_guess, still, why, usual_middle)
    begin, end = float(source.times.min()), float(source.times.max())
    middle = (begin + end) / 2
    reference = reference_time(source.times, config.motion_reference)
    is_solved = solves and config.motion == 'solve'
    try:
        track = find(begin, end)
    except UnknownMotion as error:
        if not is_solved:
            return _not_undone(source, T_guess, still, str(error), middle)
        track = Track.of_twist(np.zeros(6))
    twist = track.mean_twist(begin, end)
    T_reference = T_guess @ track.step(0.0, reference)
    if is_solved:
        return Undoing(source, T_reference, config, reference, twist, None, track, middle)
    moved = undone(source, track, reference)
    known = {'twist': twist, 'moved': _shift(source, moved), 'motion_flaw': ''}
    return Undoing(moved, T_reference, still, reference, None, known, track, middle)


def undone(cloud, track, reference):
    """Return a `Cloud` with times as it would have been measured at one instant.

    Args:
        cloud: `Cloud`.
        track: `Track` of its sensor.
        reference: the instant [s].
    """
    return cloud.moved_to(track.undone(cloud.points, cloud.times, reference, cloud.origin))


def _not_undone(source, T_guess, config, why, middle):
    known = {'twist': None, 'moved': 0.0, 'motion_flaw': why}
    return Undoing(source, T_guess, config, known=known, middle=middle)


def _shift(before, after):
    every = max(len(before) // SAMPLE, 1)
    return float(np.median(np.linalg.norm((after.points - before.points)[::every], axis=1)))
