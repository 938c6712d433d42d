"""Initial guesses: buffered by stamp, interpolated to a source's, refused where doubtful."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import covariance_of, matrix_of, stamp_ns
from idem_ros.pairing.stamped_poses import DoubtfulGuess, StampedPoses, pose_at
from idem_ros.pairing.trail import Trail
from idem_ros.parameters.fields import parameter, require_one_of, require_positive

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
        require_one_of('initial_guess.type', self.type, GUESS_TYPES)
        for name in ('max_age', 'max_jump', 'lost_after'):
            if getattr(self, name) is not None:
                require_positive(f'initial_guess.{name}', getattr(self, name))


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


class StreamedGuesses:
    """Guesses that come as messages: TransformStamped, PoseWithCovarianceStamped or Odometry."""

    def __init__(self):
        self._poses = StampedPoses()
        self._timeless = None
        self._begins_at_zero = False

    def __bool__(self):
        return bool(self._poses) or self._timeless is not None

    def stamps(self, message):
        """Return (stream, stamp) of what a message holds."""
        return [('initial_guess', stamp_ns(message))]

    def add(self, message):
        """Keep a guess; one with stamp 0 serves every source until another comes.

        Where a source had that stamp, as under a simulated clock, it is a time like any other.

        Raises:
            InvalidTransform: one with stamp 0 is none; that before serves on.
        """
        if not stamp_ns(message):
            matrix_of(message)
        self._timeless = None if stamp_ns(message) else message
        if self._timeless is None or self._begins_at_zero:
            self._poses.add(message)

    def forget_after(self, stamp):
        """Forget what is later than a stamp [ns]."""
        self._poses.forget_after(stamp)

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess` for a source of a stamp [ns].

        Raises:
            NotYet: none can be made of what has come so far.
            DoubtfulGuess, InvalidTransform: none will do.
        """
        if not stamp:
            self._begin_at_zero()
        is_time = self._begins_at_zero and stamp < WALL_CLOCK
        if self._timeless is not None and stamp not in self._poses and not is_time:
            guess = _guess_of([self._timeless], matrix_of(self._timeless))
            return replace(guess, is_timeless=True)
        messages = self._around(stamp)
        if len({frames_of(message) for message in messages}) > 1:
            raise DoubtfulGuess(
                'those before and after the source are between different frames: '
                + ' and '.join(
                    f'{child!r} in {parent!r}' for parent, child in map(frames_of, messages)
                )
            )
        guess = _guess_of(messages, pose_at(stamp, messages, config))
        return replace(guess, trail=self._trail(stamp, frames_of(messages[0])))

    def _trail(self, stamp, frames):
        near = self._poses.near(stamp)
        stamps = tuple(each for each in near.stamps if frames_of(near[each]) == frames)
        return Trail(stamps, lambda each: matrix_of(near[each]))

    def _around(self, stamp):
        try:
            return self._poses.around(stamp)
        except NotYet as missing:
            if self._is_one_click:
                hint = 'it is the only one: of initial_guess.type initial_pose it would suffice'
                raise NotYet(f'{missing}; {hint}') from missing
            raise

    @property
    def _is_one_click(self):
        return len(self._poses) == 1 and not hasattr(self._poses.newest, 'child_frame_id')

    def _begin_at_zero(self):
        self._begins_at_zero = True
        if self._timeless is not None:
            self._poses.add(self._timeless)


class IdentityGuess:
    """The identity for every source."""

    def __bool__(self):
        return True

    def forget_after(self, stamp):
        """Forget nothing."""

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess`."""
        return Guess(np.eye(4))


def _guess_of(messages, pose):
    """Return the `Guess` between one or two messages: as unsure as the less sure of them."""
    said = [each for each in map(covariance_of, messages) if each is not None]
    covariance = max(said, key=np.trace) if len(said) == len(messages) else None
    return Guess(pose, *frames_of(messages[0]), covariance=covariance)


def frames_of(message):
    """Return the frames of target and source that a guess names; empty where it does not."""
    return message.header.frame_id, getattr(message, 'child_frame_id', '')
