"""How far the pose and the twist of a source may be from the truth whose motion was solved.

The jackknife of `covariance` over the poses at the sweep's begin and end: each region's pulls on
the two, by the times of its points.
"""

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform
from idem_ros.core.geometry import se3
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.centre_groups import in_turn
from idem_ros.core.solve.cost import JointEntropy, Linearization
from idem_ros.core.solve.linearization import NOT_MET, linearize
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.solve.sweep_cost import MovingCost, of_common_twist, of_each_pose, of_two_poses
from idem_ros.core.trust.covariance import FLOOR, firm_and_loose, scatter_of
from idem_ros.core.trust.curvature import stiff_and_curved
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.regions import groups_of

BOW = 8.0  # of chord times angle: how high the bow is
TIMES = 4  # parts of the sweep that a region's points are told apart by
PERIOD = 8  # regions along each axis, after which they repeat


def by_region_in_motion(
    moving: MovingCost, cost: JointEntropy, T: Transform, observability: Observability
) -> Linearization:
    """Return gradients (G, 12) and Gauss-Newton matrices (G, 12, 12) of the regions.

    Args:
        moving: of the last stage, where it ended.
        cost: of the source as it lies there.
        T: (4, 4) the pose at the reference, between the clouds' origins.
        observability: there.
    """
    of_kinds, places = groups_of(cost.balls, T, observability, PERIOD)
    times = moving.times_of_centres(T, TIMES)
    regions = len(places)
    groups = tuple(TIMES * (g % regions) + time for g, time in zip(of_kinds, times, strict=True))
    count = TIMES * regions
    turns = tuple(in_turn(group, count) for group in groups)
    sums = tuple(np.zeros((2, 1, count, SUMS)))
    linearize(cost.balls.sides(T), NOT_MET, T[None], cost.ball_cost, turns, groups, sums)
    _, pulls, stiffness = of_both(sums[0], sums[1], T[None])
    pulls, stiffness = pulls.reshape(-1, TIMES, 6), stiffness.reshape(-1, TIMES, 6, 6)
    some = stiffness[:, :, 3, 3].any(axis=1)
    middles = (np.arange(TIMES) + 0.5) / TIMES
    return of_two_poses(pulls[some], stiffness[some], middles)


def covariance_in_motion(
    regions: Linearization,
    sweep: Sweep,
    cost: JointEntropy,
    T: Transform,
    observability: Observability,
) -> Floats:
    """Return the (12, 12) covariance of the pose and of the twist.

    Of a twist (omega, v) on the left of the pose at the reference, and of the sweep's twist,
    x y z rx ry rz of the source frame, a second.

    Args:
        regions: `by_region_in_motion`.
        sweep: that was found.
        cost, T, observability: as there; what is free is so in both poses.
    """
    of_poses = _of_two_poses(regions, cost, T, observability)
    found = of_pose_and_twist(of_poses, sweep, T)
    found[:6, :6] += _of_bends(sweep, T, observability)
    return found


def of_pose_and_twist(of_poses: Floats, sweep: Sweep, T: Transform) -> Floats:
    """Return the (12, 12) covariance of pose and twist, as above, by that of the two poses."""
    to_frame = se3.adjoint(se3.translation(sweep.measured.origin)) @ se3.adjoint(se3.inverse(T))
    change = np.kron([-1.0, 1.0], to_frame[se3.ROS_ORDER]) / (sweep.end - sweep.begin)
    share = np.kron([1.0 - sweep.fraction, sweep.fraction], np.eye(6))
    both = np.asarray(np.concatenate([share, change]), np.float64)
    return both @ of_poses @ both.T


def _of_bends(sweep: Sweep, T: Transform, observability: Observability) -> Matrix6:
    """Return what a speed that nothing tells leaves of the pose's covariance, (6, 6).

    A sensor that turns by theta while it moves by s goes along a bow, s theta / 8 high. Where
    nobody knows s, the bow is missed: aside at the middle, and so turned from ahead to behind.
    """
    total = np.zeros((6, 6))
    if sweep.given is not None or sweep.twist is None:
        return total
    theta = T[:3, :3] @ sweep.twist[:3] * (sweep.end - sweep.begin)
    for _, way in observability.ways(~observability.observable):
        bow = np.cross(theta, way) / BOW
        turn, aside = np.cross(way, bow), observability.lever_arm * bow
        total[:3, :3] += np.outer(turn, turn)
        total[3:, 3:] += np.outer(aside, aside)
    return total


def _of_two_poses(
    regions: Linearization, cost: JointEntropy, T: Transform, observability: Observability
) -> Floats:
    """Return the (12, 12) covariance of twists (omega, v) on the left of the two poses."""
    of_one, moved, _ = firm_and_loose(observability.constrained, of_common_twist(regions).matrix)
    firm, roots = stiff_and_curved(cost, T, of_one, moved)
    softer = of_each_pose(roots @ np.linalg.pinv(firm))
    units = of_each_pose(observability.constrained)
    constrained, _, loose = firm_and_loose(units, regions.matrix.sum(axis=0))
    loose = np.concatenate([of_each_pose(observability.free), loose], axis=1)
    scatter = scatter_of(regions.gradient, regions.matrix, constrained, softer @ constrained)
    floor = (FLOOR * cost.balls.radius) ** 2 * units @ units.T
    return scatter + floor + observability.lever_arm**2 * loose @ loose.T
