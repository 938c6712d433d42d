import numpy as np
from clouds import motion

from idem_ros.core import se3
from idem_ros.core.solver import minimize_on_se3


def bowl(anchors, goal):
    """Sum of squared distances of moved anchors to their goals, as gradient and matrix."""

    def linearize(transform):
        gradient, matrix = np.zeros(6), np.zeros((6, 6))
        for anchor, end in zip(anchors, se3.transform_points(goal, anchors), strict=True):
            x = transform[:3, :3] @ anchor + transform[:3, 3]
            J = np.c_[-se3.skew(x), np.eye(3)]
            gradient += J.T @ (x - end)
            matrix += J.T @ J
        return gradient, matrix

    return linearize


def test_finds_the_bottom_of_a_bowl(rng):
    goal = motion(rng, 25, 2)
    solution = minimize_on_se3(bowl(rng.random((6, 3)), goal), np.eye(4), 50, 1e-9, 1e-9)
    assert solution.converged
    np.testing.assert_allclose(solution.transform, goal, atol=1e-7)


def test_started_at_the_bottom_it_converges_at_once(rng):
    solution = minimize_on_se3(bowl(rng.random((6, 3)), np.eye(4)), np.eye(4), 50, 1e-9, 1e-9)
    assert solution.converged
    assert solution.iterations == 1


def test_says_when_the_steps_did_not_suffice(rng):
    solution = minimize_on_se3(
        bowl(rng.random((6, 3)), motion(rng, 25, 2)), np.eye(4), 2, 1e-9, 1e-9
    )
    assert not solution.converged
    assert solution.iterations == 2


def test_a_direction_without_stiffness_is_left_alone():
    anchors = np.array([[0, 0, 1.0], [0, 0, 2.0], [0, 0, -1.0]])  # turning about z changes nothing
    goal = motion(np.random.default_rng(1), 0, 1)
    solution = minimize_on_se3(bowl(anchors, goal), np.eye(4), 50, 1e-9, 1e-9)
    assert solution.converged
    np.testing.assert_allclose(solution.transform, goal, atol=1e-8)


def test_no_stiffness_at_all_moves_nothing():
    solution = minimize_on_se3(
        lambda T: (np.zeros(6), np.zeros((6, 6))), np.eye(4), 50, 1e-9, 1e-9
    )
    np.testing.assert_array_equal(solution.transform, np.eye(4))


def test_a_minimum_at_a_jump_is_reached_too():
    """Like |x|: the gradient changes sign where a member enters a ball, and never vanishes."""

    def kink(transform):
        gradient = np.zeros(6)
        gradient[3:] = np.sign(transform[:3, 3] - 0.3)
        return gradient, np.eye(6)

    solution = minimize_on_se3(kink, np.eye(4), 80, 1e-6, 1e-6)
    assert solution.converged
    np.testing.assert_allclose(solution.transform[:3, 3], 0.3, atol=0.02)
