"""What six more unknowns cost at least: by the information of the same balls, at the truth.

Of a sensor that stands still the pose is known by the inverse of their stiffness, (6, 6). Where
the two poses at the sweep's begin and end are solved, that is (12, 12), and less is known of the
pose between them. Either is in units of the variance that the standing sensor's covariance has.
"""

import numpy as np

from idem_ros.core import Cloud
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.solve.cost import Linearization
from idem_ros.core.solve.pair import prepare, with_stages
from idem_ros.core.solve.sweep import sweep_of
from idem_ros.core.solve.sweep_cost import MovingCost, of_common_twist
from idem_ros.core.trust.pose_twist import pose_covariance, sweep_covariance
from idem_ros.core.trust.prior import weighed_twist
from idem_ros.core.trust.sweep_covariance import of_pose_and_twist
from idem_ros.core.trust_tuning import TRUST
from idem_ros.core.tuning import SOLVER
from idem_ros.core.workers import Workers

NOTHING = 0.0, 0.0  # is known of the twist
ROTATION, TRANSLATION = slice(3, 6), slice(0, 3)


def least_ratios(a_sweep, config, standing, sigma=NOTHING):
    """Return the least errors (rotation, translation) over those of a sensor standing still.

    Args:
        a_sweep: `cases.Sweep`.
        config: `RegistrationConfig` that solves the motion, its voxels a number.
        standing: (6, 6) covariance of the standing sensor's pose.
        sigma: how far off the twist may be that is known, as `twist_sigma` has it.
    """
    target, source = Cloud(a_sweep.still.target), Cloud(a_sweep.points, a_sweep.times)
    sweep = sweep_of(source, a_sweep.twist, config)
    pair = prepare(target, sweep.undone(), config, SOLVER, TRUST, Workers(1))
    pair = with_stages(pair).swept_as(sweep)
    T = between_origins(target, source, a_sweep.still.truth)
    moving = MovingCost(pair.around(T), pair.stages[-1], pair.sweep)
    stiffness = moving.linearize(pair.sweep.poses(T)).matrix
    rigid = of_common_twist(Linearization(np.zeros((1, 12)), stiffness[None])).matrix
    position = T[:3, 3] - T[:3, :3] @ source.origin
    still = pose_covariance(_inverse(rigid), position)
    unit = np.trace(np.linalg.solve(still, standing)) / 6
    both = sweep_covariance(of_pose_and_twist(_inverse(stiffness), pair.sweep, T), position)
    twist = a_sweep.twist
    if any(sigma):
        both = weighed_twist(T, twist, unit * both, twist, sigma, position).covariance / unit
    return tuple(
        float(np.sqrt(np.trace(both[axes, axes]) / np.trace(still[axes, axes])))
        for axes in (ROTATION, TRANSLATION)
    )


def _inverse(matrix):
    return np.linalg.pinv(matrix, hermitian=True)
