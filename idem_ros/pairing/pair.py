"""A source with what belongs to it, or the reason why it is refused."""

from dataclasses import dataclass
from typing import Any

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.targets import UnusableTarget
from idem_ros.pairing.turn_rates import TurnRates


@dataclass(frozen=True)
class Pair:
    """A source cloud with its target, as they came, and the guess it is registered from."""

    target: Any
    source: Any
    guess: Guess
    jumps: int = 0
    """How often the clock had been set back: a result from before is no guess for after."""
    rates: TurnRates | None = None
    """Those of an IMU around the stamp; None: none came."""

    @property
    def stamp(self):
        """The source's stamp [ns]."""
        return stamp_ns(self.source)


@dataclass(frozen=True)
class Refusal:
    """A source that no pair was made of, or an input that none is made with, and why."""

    stamp: int
    reason: str
    role: str = 'source'


def frame_contradiction(name, frames, cloud_frames):
    """Say which frames of a transform and its clouds contradict each other.

    Args:
        name: what the message calls the transform.
        frames: of the transform, (frame_id, child_frame_id): source in target frame.
        cloud_frames: of the target and the source; an empty one contradicts nothing.

    Returns:
        A sentence; empty where nothing contradicts.
    """
    roles = (('frame_id', 'target'), ('child_frame_id', 'source'))
    for (key, role), frame, of_cloud in zip(roles, frames, cloud_frames, strict=True):
        if frame and of_cloud and frame.lstrip('/') != of_cloud.lstrip('/'):
            return (
                f'the {name} has {key} {frame!r}, but the {role} cloud is in frame '
                f'{of_cloud!r}; they must be the same'
            )
    return ''


def require_frames(guess, target, source):
    """Refuse a `Guess` whose frames contradict those of its clouds.

    Raises:
        IdemError: it says which.
    """
    of_clouds = target.header.frame_id, source.header.frame_id
    reason = frame_contradiction('guess', (guess.target_frame, guess.source_frame), of_clouds)
    if reason:
        raise IdemError(reason)


def named(role, find, *given):
    """Find one of the inputs; let its error say which it is."""
    try:
        return find(*given)
    except NotYet as missing:
        raise NotYet(f'{role}: {missing}', missing.is_doubtful) from missing
    except IdemError as error:
        raise type(error)(f'{role}: {error}') from error


def comes(find, *given):
    """Return whether what a source needs is settled, be it by a refusal."""
    try:
        find(*given)
    except NotYet:
        return False
    except IdemError:
        return True
    return True


def refined(refine, pair, pairing):
    """Refine a pair; where its target turns out unusable, its source with another target.

    Args:
        refine: takes a `Pair`; returns what comes of it.
        pair: of the pairing.
        pairing: has `without_target`, as `Pairing` does.

    Raises:
        IdemError: what the refinement raises; `UnusableTarget` where there is no other target, and
            nothing came of it.
    """
    while True:
        try:
            return refine(pair)
        except UnusableTarget as error:
            try:
                pair = pairing.without_target(pair, error)
            except UnusableTarget:
                if error.refinement is None:
                    raise
                return error.refinement
