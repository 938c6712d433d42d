"""How far a pose is from the truth: an angle and a distance."""

import numpy as np
from scipy.spatial.transform import Rotation


def rotation_error_deg(transform, truth):
    """Return the angle [deg] between the rotations of two (4, 4) transforms."""
    difference = Rotation.from_matrix(truth[:3, :3].T @ transform[:3, :3])
    return float(np.degrees(difference.magnitude()))


def translation_error_m(transform, truth):
    """Return the distance between the translations of two (4, 4) transforms, in their unit."""
    return float(np.linalg.norm(transform[:3, 3] - truth[:3, 3]))
