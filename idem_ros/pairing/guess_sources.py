"""What keeps the guesses of each type, see `GuessConfig.type`, and the rates that go with them."""

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guesses import FOLLOWING, STREAMED, IdentityGuess
from idem_ros.pairing.last_result import LastResult
from idem_ros.pairing.streamed_guesses import StreamedGuesses
from idem_ros.pairing.transform_tree import TransformTree
from idem_ros.pairing.turn_rates import TurnRates


def guesses_of(kind):
    """Return what keeps guesses of a type."""
    if kind in STREAMED:
        return StreamedGuesses()
    if kind == 'tf':
        return TransformTree()
    if kind in FOLLOWING:
        return LastResult(needs_pose=kind == 'initial_pose')
    return IdentityGuess()


def rates_near(source, messages, guesses, config):
    """Return the `TurnRates` around the stamp of a source; None: no IMU was heard then.

    Args:
        source: PointCloud2.
        messages: `StampedPoses` of the IMU.
        guesses: those of tf tell how its frame is turned in that of the source.
        config: `GuessConfig`.
    """
    near = messages.near(stamp_ns(source))
    if not near:
        return None
    frames = [each.header.frame_id.lstrip('/') for each in (source, near.newest)]
    turn = np.eye(3) if frames[0] == frames[1] else None
    if turn is None and isinstance(guesses, TransformTree):
        try:
            guess = guesses.guess_for(stamp_ns(near.newest), *frames, config)
            turn = guess.T_target_source[:3, :3]
        except IdemError:
            turn = None
    return TurnRates(near, frames[1], turn)
