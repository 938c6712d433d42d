"""What became of a recording: numbers of each frame and its errors, no messages and no clouds."""

from collections.abc import Callable
from collections.abc import Sequence as Records
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from idem_ros.pairing.pair import Refusal
from idem_ros.recording.topics import Topics
from idem_ros.refinement.outcome import Refinement
from idem_ros.replay.settings import IDEM


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the truth."""

    translation_m: float
    rotation_deg: float


def pose_error(transform, truth):
    """Return the `PoseError` of a (4, 4) transform; None where the truth is None."""
    if truth is None:
        return None
    return PoseError(translation_error_m(transform, truth), rotation_error_deg(transform, truth))


def rotation_error_deg(transform, truth):
    """Return the angle [deg] between the rotations of two (4, 4) transforms."""
    difference = Rotation.from_matrix(truth[:3, :3].T @ transform[:3, :3])
    return float(np.degrees(difference.magnitude()))


def translation_error_m(transform, truth):
    """Return the distance between the translations of two (4, 4) transforms, in their unit."""
    return float(np.linalg.norm(transform[:3, 3] - truth[:3, 3]))


@dataclass(frozen=True)
class Frame:
    """One refined source of a recording."""

    log_time: int
    """Of the message that completed the pair [ns]."""
    refinement: Refinement
    truth: NDArray | None
    """(4, 4), source in target frame; None where the recording has none for this source."""

    def error_before(self) -> PoseError | None:
        """Return the `PoseError` of the guess, or None without truth."""
        return pose_error(self.refinement.T_guess, self.truth)

    def error_after(self) -> PoseError | None:
        """Return the `PoseError` of the result, or None without truth."""
        return pose_error(self.refinement.result.T_target_source, self.truth)


class Frames(Records):
    """The frames of a replay, each read from disk when it is asked for.

    Args:
        results: of (log time, `Refinement`).
        truth_of: gives the (4, 4) truth of a `Refinement`, or None.
    """

    def __init__(
        self,
        results: Records[tuple[int, Refinement]],
        truth_of: Callable[[Refinement], NDArray | None],
    ):
        self._results, self._truth_of = results, truth_of

    def __len__(self):
        """Return how many there are."""
        return len(self._results)

    def __getitem__(self, index):
        """Return a `Frame`, or a list of those of a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        log_time, refinement = self._results[index]
        return Frame(log_time, refinement, self._truth_of(refinement))


@dataclass(frozen=True)
class Sequence:
    """What odometry knows beside its frames, whose transforms are poses in the first scan's."""

    map: str
    """What each scan was registered to, one of `settings.SEQUENCES`."""
    first_stamp: int
    """Of the first scan [ns], whose pose is the identity and which has no frame."""
    errors: dict | None
    """See `comparison_table.compared`; None: without truth."""


@dataclass(frozen=True)
class Replay:
    """What became of a recording's sources; every one of them is counted once."""

    path: str
    topics: Topics
    frames: Records[Frame]
    """On disk, see `Spool`; so are the refused."""
    refused: Records[Refusal]
    """Sources with a reason why they were not refined."""
    notes: tuple[str, ...]
    """What a reader should know of the recording: no guess topic, a missing end."""
    dropped: int = 0
    """Sources that waited for a target or a guess until newer ones took their place."""
    unpaired: int = 0
    """Sources that still waited when the recording ended."""
    unpaired_for: str = ''
    """What those waited for."""
    unpaired_why: str = ''
    """Why the newest of those that still waited did."""
    method: str = IDEM
    """What registered, one of `settings.METHODS`."""
    interrupted: bool = False
    """Whether somebody pressed Ctrl-C; then it is of what was done until then."""
    sequence: Sequence | None = None
    """None: pairs were refined."""
    lost: dict[str, int] = field(default_factory=dict)
    """What of the recording could not be read, see `part.LOSSES`."""
