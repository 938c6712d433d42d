import numpy as np
import pytest

from idem_ros.core.geometry import se3
from idem_ros.core.trust.prior import weighed_twist

NOBODY = np.zeros(3)


def joint(rng, pose=0.01, twist=0.1):
    """A covariance (12, 12) of errors that go together."""
    mixed = rng.normal(size=(12, 12)) * np.repeat([pose, twist], 6)[:, None]
    return mixed @ mixed.T


def test_a_twist_known_exactly_is_taken_and_moves_the_pose_by_how_their_errors_go_together(rng):
    covariance, found = joint(rng), rng.normal(size=6)
    given = found + 0.05
    weighed = weighed_twist(np.eye(4), found, covariance, given, (1e-9, 1e-9), NOBODY)
    assert weighed.twist == pytest.approx(given, abs=1e-6)
    expected = covariance[:6, 6:] @ np.linalg.solve(covariance[6:, 6:], given - found)
    moved = se3.log(weighed.transform)[[3, 4, 5, 0, 1, 2]]
    assert moved == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert np.abs(weighed.covariance[6:, 6:]).max() < 1e-12


def test_two_that_are_as_sure_meet_half_way(rng):
    covariance = np.eye(12) * 0.04
    found, given = np.zeros(6), np.array([0.2, 0.0, 0.1, 0.1, 0.0, -0.1])
    weighed = weighed_twist(np.eye(4), found, covariance, given, (0.2, np.degrees(0.2)), NOBODY)
    assert weighed.twist == pytest.approx(given / 2)
    assert weighed.covariance[6:, 6:] == pytest.approx(np.eye(6) * 0.02)
    assert weighed.transform == pytest.approx(np.eye(4))


def test_a_half_of_which_nothing_is_known_is_left_to_the_clouds(rng):
    covariance, found = np.eye(12) * 0.04, rng.normal(size=6)
    weighed = weighed_twist(np.eye(4), found, covariance, found + 0.1, (0.2, 0.0), NOBODY)
    assert weighed.twist[:3] == pytest.approx(found[:3] + 0.05)
    assert weighed.twist[3:] == pytest.approx(found[3:])


def test_one_that_is_much_farther_than_it_says_is_not_believed(rng):
    covariance, found = np.eye(12) * 1e-4, rng.normal(size=6)
    weighed = weighed_twist(np.eye(4), found, covariance, found + 5.0, (0.1, 0.1), NOBODY)
    assert not weighed.is_believed
    assert np.array_equal(weighed.twist, found)
