"""How far the pairs of an instant contradict one another, where they close loops.

What a scan says of noise is in its covariance; what bends it, a motion or a sensor's own error, is
not, and shows in that two clouds alone end elsewhere than all at once.
"""

from dataclasses import replace

import numpy as np

from idem_ros.calibration.fusion import difference
from idem_ros.core import Verdict, register
from idem_ros.core.geometry import se3

TELLS = Verdict.ALIGNED, Verdict.DEGENERATE, Verdict.LOW_OVERLAP
LEAST_OVERLAP = 0.05
SAME_M, SAME_DEG = 0.5, 3.0  # what ends farther off is another valley


def contradiction(clouds, result, config):
    """Return the factor, from 1, by which variances of an instant are to be multiplied.

    The squares of what pairs alone are off the poses, over their covariances, a degree of freedom
    of the loops that they close; 1 where they close none.

    Args:
        clouds: `Cloud`s.
        result: their `JointResult`.
        config: `RegistrationConfig` that finds what is near.
    """
    freedom, squares = -6 * (len(clouds) - 1), 0.0
    if len(result.edges) < len(clouds):
        return 1.0
    config = replace(config, voxel_size=result.voxel_size)
    for edge in result.edges:
        off = _off(clouds, result.poses, edge, config)
        if off is not None:
            freedom += 6
            squares += off
    return max(squares / freedom, 1.0) if freedom > 0 else 1.0


def _off(clouds, poses, edge, config):
    """Return the square of what two clouds alone are off, in covariances; None: they tell not."""
    if edge.overlap < LEAST_OVERLAP:
        return None
    T = se3.inverse(poses[edge.i]) @ poses[edge.j]
    alone = register(clouds[edge.i], clouds[edge.j], T, config)
    assert alone.assessment is not None, 'verdicts are asked for'
    if alone.assessment.verdict not in TELLS:
        return None
    off = difference(alone.T_target_source, T)
    distance, degrees = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
    if distance > SAME_M or degrees > SAME_DEG:
        return None
    return float(off @ np.linalg.solve(alone.assessment.covariance, off))
