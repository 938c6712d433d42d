import numpy as np
import pytest
from clouds import motion, surface
from costs import joint_entropy

from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.core.solve.newton import Criteria, Termination, minimize, moved
from idem_ros.core.solve.pair import Stage
from idem_ros.core.solve.sweep import Sweep
from idem_ros.core.solve.sweep_cost import MovingCost, of_two_poses

RADIUS = 0.2


class OneStage:
    """What a `MovingCost` asks of a `Pair`: the cost of its one stage."""

    def __init__(self, target, source=None):
        self.target, self.source = target, source

    def _replace(self, **clouds):
        return OneStage(**{'target': self.target, 'source': self.source, **clouds})

    def cost(self, stage):
        return joint_entropy(self.target, self.source, stage.radius)


def moving_cost(target, points, times, twist=(0.0,) * 6):
    sweep = Sweep(Cloud(points, times), np.array(twist), 0.5, 0.0, 1.0, is_solved=True)
    return MovingCost(OneStage(target), Stage(RADIUS, None, is_last=True), sweep), sweep


@pytest.fixture
def clouds(rng):
    return Cloud(surface(rng, 1500, 0.003)), surface(rng, 1500, 0.003)


def test_moving_both_poses_alike_is_a_rigid_motion(clouds, rng):
    target, points = clouds
    moving, sweep = moving_cost(target, points, rng.random(len(points)))
    T = motion(rng, 1, 0.01)
    gradient, matrix = moving.linearize(sweep.poses(T))
    rigid = joint_entropy(target, Cloud(points), RADIUS).linearize(T)
    assert gradient[:6] + gradient[6:] == pytest.approx(rigid.gradient, rel=1e-9, abs=1e-9)
    together = matrix.reshape(2, 6, 2, 6).sum(axis=(0, 2))
    assert together == pytest.approx(rigid.matrix, rel=1e-9, abs=1e-9)


def test_points_of_the_begin_pull_at_the_first_pose_alone(clouds, rng):
    target, points = clouds
    T = motion(rng, 1, 0.01)
    for time, first, second in ((0.0, slice(0, 6), slice(6, 12)), (1.0, slice(6, 12), slice(6))):
        times = np.full(len(points), time)
        moving, sweep = moving_cost(target, points, times)
        gradient, _ = moving.linearize(sweep.poses(T))
        assert np.abs(gradient[second]).max() < 0.02 * np.abs(gradient[first]).max()


def test_two_poses_interpolate_between_the_twists_of_either(rng):
    times, jacobians = rng.random(7), rng.normal(size=(7, 4, 6))
    residuals = rng.normal(size=(7, 4))
    gradient, matrix = np.zeros(12), np.zeros((12, 12))
    for s, J, r in zip(times, jacobians, residuals, strict=True):
        both = np.hstack([(1 - s) * J, s * J])
        gradient += both.T @ r
        matrix += both.T @ both
    found = of_two_poses(
        np.einsum('gki,gk->gi', jacobians, residuals)[None],
        np.einsum('gki,gkj->gij', jacobians, jacobians)[None],
        times,
    )
    assert found.gradient[0] == pytest.approx(gradient, rel=1e-12)
    assert found.matrix[0] == pytest.approx(matrix, rel=1e-12)


def test_the_poses_of_a_sweep_are_read_back(rng):
    twist, T = np.array([0.2, -0.1, 0.3, 1.0, 2.0, -0.5]), motion(rng, 40, 3.0)
    sweep = Sweep(Cloud(rng.normal(size=(9, 3)), np.zeros(9)), twist, 0.01, -0.05, 0.08)
    back, same = sweep.read(sweep.poses(T))
    assert back == pytest.approx(T, abs=1e-12)
    assert same == pytest.approx(twist, abs=1e-10)


def test_several_poses_are_moved_each_by_its_own_twist(rng):
    poses = np.array([motion(rng, 20, 1.0) for _ in range(3)])
    step = rng.normal(size=18)
    for T, twist, after in zip(poses, step.reshape(3, 6), moved(poses, step), strict=True):
        assert np.array_equal(after, se3.exp(twist) @ T)


def test_a_motion_far_beyond_a_ball_is_found(clouds, rng):
    target, points = clouds
    twist = np.array([0.1, -0.2, 0.3, 0.2, 0.3, -0.1])  # a radius and more at the sweep's ends
    times = rng.random(len(points))
    seen = np.array(
        [
            se3.transform_points(se3.exp(-(t - 0.5) * twist), p)
            for t, p in zip(times, points, strict=True)
        ]
    )
    moving, sweep = moving_cost(target, seen, times)
    solution = minimize(moving, sweep.poses(np.eye(4)), Criteria(50, 1e-5, 1e-5))
    assert solution.termination is Termination.CONVERGED
    _, T, found = moving.at(solution.transform)
    to_frame = se3.adjoint(se3.translation(found.measured.origin))
    assert np.abs(to_frame @ found.twist - twist).max() < 0.06
