import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.bare_scenes import bare_case
from benchmarks.case import displaced
from idem_ros.core import RegistrationConfig, Verdict, register
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.trust.prior import weighed


def sigmas(metres, degrees):
    return np.diag([metres**2] * 3 + [np.radians(degrees) ** 2] * 3)


def pose_difference(T, other):
    """x y z rx ry rz from T to the other, about T's own origin, in the target's axes."""
    turn = Rotation.from_matrix(other[:3, :3] @ T[:3, :3].T).as_rotvec()
    return np.r_[other[:3, 3] - T[:3, 3], turn]


def test_a_result_is_weighed_against_its_guess_as_two_normal_errors_are(rng):
    root, of_guess = rng.normal(size=(6, 6)), np.diag(rng.uniform(0.5, 2.0, 6))
    covariance = 1e-4 * (root @ root.T + np.eye(6))
    T = se3.exp(rng.normal(size=6))
    T_guess = se3.exp(1e-3 * rng.normal(size=6)) @ T
    information = np.linalg.inv(1e-4 * of_guess)
    found = weighed(T, covariance, T_guess, information, T[:3, 3])
    gain = covariance @ np.linalg.inv(covariance + 1e-4 * of_guess)
    expected = gain @ pose_difference(T, T_guess)
    np.testing.assert_allclose(pose_difference(T, found.transform), expected, atol=1e-5)
    np.testing.assert_allclose(found.covariance, covariance - gain @ covariance, atol=1e-12)
    assert found.is_believed


def test_a_free_motion_has_the_deviation_of_the_guess_and_the_others_that_of_the_clouds():
    case = bare_case('corridor', 3)
    start = displaced(case.truth, np.zeros(3), 0.5, 0.05, np.random.default_rng(1))
    plain = register(case.target, case.source, start)
    result = register(case.target, case.source, start, guess_covariance=sigmas(0.2, 2.0))
    said = result.assessment
    assert said.verdict is Verdict.DEGENERATE
    deviations = np.sqrt(np.diag(said.covariance))
    assert deviations[0] == pytest.approx(0.2, rel=0.1)  # along the corridor
    assert np.sqrt(plain.assessment.covariance[0, 0]) > 1.0
    assert (deviations[1:3] < 0.01).all()
    np.testing.assert_allclose(result.T_target_source, plain.T_target_source, atol=0.02)


def test_a_weakly_held_motion_lies_between_the_clouds_and_a_sure_guess():
    case = bare_case('box in corridor', 3)
    start = case.truth.copy()
    start[0, 3] += 0.03
    plain = register(case.target, case.source, start)
    sigma = np.sqrt(plain.assessment.covariance[0, 0])
    result = register(case.target, case.source, start, guess_covariance=sigmas(sigma, 5.0))
    x, of_clouds = result.T_target_source[0, 3], plain.T_target_source[0, 3]
    assert (x - of_clouds) / (start[0, 3] - of_clouds) == pytest.approx(0.5, abs=0.1)
    assert np.sqrt(result.assessment.covariance[0, 0]) == pytest.approx(sigma / 2**0.5, rel=0.1)


def test_a_guess_that_is_not_as_near_as_it_says_counts_for_nothing(rng):
    case = bare_case('box in corridor', 5)
    start = displaced(case.truth, np.zeros(3), 1.0, 0.1, rng)
    plain = register(case.target, case.source, start)
    result = register(case.target, case.source, start, guess_covariance=sigmas(1e-4, 0.01))
    np.testing.assert_array_equal(result.T_target_source, plain.T_target_source)
    assert 'deviations from the guess, which is not weighed' in result.assessment.reason


def test_a_variance_of_zero_says_nothing_of_its_axis():
    case = bare_case('corridor', 7)
    covariance = np.diag([0.0, 0.04, 0.04, 0.0, 0.0, 0.01])
    for given in (covariance, np.zeros((6, 6))):
        result = register(case.target, case.source, case.truth, guess_covariance=given)
        assert np.sqrt(result.assessment.covariance[0, 0]) > 1.0


def test_a_deviation_of_every_guess_is_that_of_those_without_a_covariance():
    case = bare_case('corridor', 8)
    config = RegistrationConfig(guess_sigma=(0.3, 1.0))
    of_all = register(case.target, case.source, case.truth, config)
    own = register(case.target, case.source, case.truth, guess_covariance=sigmas(0.3, 1.0))
    np.testing.assert_allclose(of_all.assessment.covariance, own.assessment.covariance, rtol=1e-9)


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        (np.eye(3), r'shape \(3, 3\)'),
        ('much', 'must be'),
        (np.full((6, 6), np.nan), 'not finite'),
        (-np.eye(6), 'below 0'),
        (np.eye(6) + np.eye(6, k=1), 'not symmetric'),
        (np.ones((6, 6)), 'positive definite'),
    ],
)
def test_what_is_no_covariance_is_refused(rng, given, said):
    points = rng.random((50, 3))
    with pytest.raises(InvalidConfig, match=said):
        register(points, points, guess_covariance=given)


def test_a_deviation_is_refused_where_nothing_could_weigh_it():
    with pytest.raises(InvalidConfig, match='assessment none'):
        RegistrationConfig(guess_sigma=(0.1, 1.0), assessment='none')
