import numpy as np
import pytest
from clouds import motion

from idem_ros.core.geometry import se3
from idem_ros.core.solve.newton import Criteria, Termination, accept, minimize
from idem_ros.core.workers import Workers


class Bowl:
    """Half the sum of squared distances of moved anchors to their goals."""

    def __init__(self, anchors, goal):
        self.anchors, self.ends = anchors, se3.transform_points(goal, anchors)

    def linearize(self, transform):
        gradient, matrix = np.zeros(6), np.zeros((6, 6))
        for anchor, end in zip(self.anchors, self.ends, strict=True):
            x = transform[:3, :3] @ anchor + transform[:3, 3]
            J = np.c_[-se3.skew(x), np.eye(3)]
            gradient += J.T @ (x - end)
            matrix += J.T @ J
        return gradient, matrix


class Along:
    """A cost of the translation alone, by its gradient; its matrix is the identity."""

    def __init__(self, gradient):
        self._gradient, self.seen = gradient, []

    def linearize(self, transform):
        self.seen.append(transform[0, 3])
        return np.r_[np.zeros(3), self._gradient(transform[:3, 3])], np.eye(6)


EXACT = Criteria(50, 1e-9, 1e-9)


def test_finds_the_bottom_of_a_bowl(rng):
    goal = motion(rng, 25, 2)
    solution = minimize(Bowl(rng.random((6, 3)), goal), np.eye(4), EXACT)
    assert solution.converged
    np.testing.assert_allclose(solution.transform, goal, atol=1e-7)


def test_started_at_the_bottom_it_converges_at_once(rng):
    solution = minimize(Bowl(rng.random((6, 3)), np.eye(4)), np.eye(4), EXACT)
    assert solution.converged
    assert solution.iterations == 1


def test_says_when_the_steps_did_not_suffice(rng):
    bowl = Bowl(rng.random((6, 3)), motion(rng, 25, 2))
    solution = minimize(bowl, np.eye(4), Criteria(2, 1e-9, 1e-9))
    assert solution.termination is Termination.MAX_ITERATIONS
    assert solution.iterations == 2


def test_a_direction_without_stiffness_is_left_alone():
    anchors = np.array([[0, 0, 1.0], [0, 0, 2.0], [0, 0, -1.0]])  # turning about z changes nothing
    goal = motion(np.random.default_rng(1), 0, 1)
    solution = minimize(Bowl(anchors, goal), np.eye(4), EXACT)
    assert solution.converged
    np.testing.assert_allclose(solution.transform, goal, atol=1e-8)


def test_no_stiffness_at_all_moves_nothing():
    class Flat(Along):
        def linearize(self, transform):
            return np.zeros(6), np.zeros((6, 6))

    solution = minimize(Flat(None), np.eye(4), EXACT)
    np.testing.assert_array_equal(solution.transform, np.eye(4))


def test_a_minimum_at_a_jump_is_reached_too():
    """Like |x|: the gradient changes sign where a member enters a ball, and never vanishes."""
    kink = Along(lambda t: np.sign(t - 0.3))
    solution = minimize(kink, np.eye(4), Criteria(80, 1e-6, 1e-6))
    assert solution.converged
    np.testing.assert_allclose(solution.transform[:3, 3], 0.3, atol=0.02)


def test_a_far_move_that_overshoots_is_taken_back_to_newtons_own():
    """Steps that do not shrink ask for a longer one; behind x = 2 there is a wall."""
    slope = Along(lambda t: np.array([-0.5 if t[0] < 2 else 20.0, 0, 0]))
    minimize(slope, np.eye(4), Criteria(4, 1e-9, 1e-9))
    seen = np.array(slope.seen)
    beyond = int(np.argmax(seen > 2.0))
    assert seen[beyond] == pytest.approx(seen[beyond - 1] + 4 * 0.5)
    assert seen[beyond + 1] == pytest.approx(seen[beyond - 1] + 0.5)


def test_only_moves_beyond_what_the_matrix_majorises_must_show_that_they_did_not_overshoot():
    assert accept(left=9.0, before=1.0, relaxation=2.0)
    assert accept(left=3.9, before=1.0, relaxation=4.0)
    assert not accept(left=4.1, before=1.0, relaxation=2.1)


def test_a_deadline_that_has_passed_ends_it_at_the_start(rng):
    late = Criteria(50, 1e-9, 1e-9, Workers(1, deadline=0.0))
    solution = minimize(Bowl(rng.random((6, 3)), motion(rng, 25, 2)), np.eye(4), late)
    assert solution.termination is Termination.LATE
    assert solution.iterations == 1
