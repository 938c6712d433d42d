"""Initial guesses: where they come from, what they say, and the one that needs no message."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError
from idem_ros.core.parameter import parameter, require_fields
from idem_ros.messages.stamps import seconds

WINDOW = 1_500_000_000  # [ns] before and after a stamp; a sweep lasts a second at most
EXTRAPOLATED = 150_000_000  # [ns] that a motion is taken to go on beyond the first and last pose
MOST = 12  # poses of a sweep; of more, as many
STREAMED = {
    'transform': 'geometry_msgs/msg/TransformStamped',
    'pose_with_covariance': 'geometry_msgs/msg/PoseWithCovarianceStamped',
    'odometry': 'nav_msgs/msg/Odometry',
}
POSE = STREAMED['pose_with_covariance']  # what RViz's "2D Pose Estimate" sends, on /initialpose
# on ~/initial_guess, by type
HEARD = {**STREAMED, 'initial_pose': POSE, 'last': STREAMED['transform']}
FOLLOWING = ('initial_pose', 'last')  # start where such a pose says, go on from the last result
TF = 'tf2_msgs/msg/TFMessage'
GUESS_TYPES = (*STREAMED, 'tf', *FOLLOWING, 'identity')
WALL_CLOCK = 10**17  # [ns], three years: no simulation runs so long, no clock of today says so


class UncoveredSweep(IdemError):
    """A sweep that no poses say the motion of; the message names the gap."""


@dataclass(frozen=True)
class Trail:
    """The poses of the source frame in a frame that stands still, at some stamps."""

    stamps: tuple[int, ...]
    """Increasing [ns]."""
    pose_at: Callable[[int], NDArray]
    """Returns the (4, 4) pose of one of the stamps."""

    def poses_over(self, begin, end):
        """Return the stamps [ns] (K,) and poses (K, 4, 4) around an interval, two at least.

        Args:
            begin, end: [ns].

        Raises:
            UncoveredSweep: the poses begin too late, or end too early.
            InvalidTransform: one of them is none.
        """
        stamps = self.stamps
        if len(stamps) < 2:
            raise UncoveredSweep(f'of the sweep {len(stamps)} poses came; a motion takes two')
        first = min(max(bisect_right(stamps, begin) - 1, 0), len(stamps) - 2)
        last = max(min(bisect_left(stamps, end), len(stamps) - 1), first + 1)
        for gap, where in (
            (stamps[first] - begin, 'begin after'),
            (end - stamps[last], 'end before'),
        ):
            if gap > EXTRAPOLATED:
                raise UncoveredSweep(
                    f'the poses {where} the sweep does, by {seconds(gap)}; a motion is taken to '
                    f'go on for {seconds(EXTRAPOLATED)}'
                )
        count = min(last + 1 - first, MOST)
        chosen = [stamps[round(each)] for each in np.linspace(first, last, count)]
        return np.array(chosen), np.array([self.pose_at(each) for each in chosen])


@dataclass(frozen=True)
class GuessConfig:
    """Where initial guesses come from, and when they are not believed."""

    type: str = parameter(
        'transform',
        'where guesses come from: on ~/initial_guess, "transform" (TransformStamped), '
        '"pose_with_covariance" (PoseWithCovarianceStamped) or "odometry" (Odometry); "tf" (the '
        'source frame in the target frame, from /tf and /tf_static); "initial_pose" (the last '
        "usable result of the same frames, from the pose that comes on /initialpose, as of RViz's "
        '2D Pose Estimate, or on ~/initial_guess; every such pose and ~/reset begin anew); "last" '
        '(the same, but it begins with the identity where no pose has come, and anew, too, with '
        'the first TransformStamped on ~/initial_guess, whatever its stamp); "identity"',
        name='initial_guess.type',
        choices=GUESS_TYPES,
    )
    max_age: float | None = parameter(
        1.0,
        'a source is refused whose neighbouring guesses are farther from its stamp; one with its '
        'own stamp, or with stamp 0, is of any age',
        's',
        name='initial_guess.max_age',
    )
    max_jump: float | None = parameter(
        10.0,
        'a source is refused whose neighbouring guesses are farther apart',
        'm',
        name='initial_guess.max_jump',
    )

    lost_after: float | None = parameter(
        1.0,
        'with initial_pose or last: for so long after the last usable result its motion is '
        'carried on; then the guess stays there, and diagnostics say that the source is lost',
        's',
        name='initial_guess.lost_after',
    )

    def __post_init__(self):
        require_fields(self)


@dataclass(frozen=True)
class Guess:
    """Where a source is to be looked for."""

    T_target_source: NDArray | None
    """(4, 4); None: where the last result was."""
    target_frame: str = ''
    """Empty where the guess does not say; so `source_frame`."""
    source_frame: str = ''
    T_first: NDArray | None = None
    """(4, 4), where it is before there is a result since the start; None: the identity."""
    start: int = 0
    """Tells starts apart: a result from before one is no guess for after."""
    is_timeless: bool = False
    """Whether it has stamp 0, and serves a source of any stamp."""
    trail: Trail | None = None
    """The guesses before and after it; None: it comes alone."""
    covariance: NDArray | None = None
    """(6, 6) x y z rx ry rz of the pose; None: it does not say."""
    lost_after: float | None = None
    """How long the motion of the last results is carried on [s]; None: for ever."""


class IdentityGuess:
    """The identity for every source."""

    def __bool__(self):
        return True

    def forget_after(self, stamp):
        """Forget nothing."""

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess`."""
        return Guess(np.eye(4))


def frames_of(message):
    """Return the frames of target and source that a guess names; empty where it does not."""
    return message.header.frame_id, getattr(message, 'child_frame_id', '')
