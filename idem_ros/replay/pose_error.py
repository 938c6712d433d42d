"""How far a pose is from the truth: an angle and a distance."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


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
