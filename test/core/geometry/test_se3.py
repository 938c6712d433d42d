import numpy as np
import pytest
from clouds import motion
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from idem_ros.core import InvalidTransform
from idem_ros.core.geometry import se3


def generator(twist):
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = se3.skew(twist[:3]), twist[3:]
    return matrix


@pytest.mark.parametrize('size', [0.0, 1e-9, 1e-5, 2e-4, 0.1, 3.0])
def test_exp_is_the_matrix_exponential(rng, size):
    twist = size * rng.normal(size=6)
    np.testing.assert_allclose(se3.exp(twist), expm(generator(twist)), atol=1e-13)


@pytest.mark.parametrize('angle', [0.0, 1e-12, 1e-7, 1e-4, 0.1, 1.7, 2.5, 3.14159, np.pi - 1e-9])
def test_log_is_the_twist_that_exp_takes(rng, angle):
    for axis in (*np.eye(3), *-np.eye(3), *rng.normal(size=(20, 3))):
        omega = angle * axis / np.linalg.norm(axis)
        T = se3.exp(np.r_[omega, rng.normal(size=3)])
        twist = se3.log(T)
        np.testing.assert_allclose(se3.exp(twist), T, atol=1e-13)
        expected = Rotation.from_matrix(T[:3, :3]).as_rotvec()
        np.testing.assert_allclose(twist[:3], expected, atol=1e-9)


def test_inverse_undoes_a_motion(rng):
    T = motion(rng, 77, 3)
    np.testing.assert_allclose(se3.inverse(T) @ T, np.eye(4), atol=1e-15)


def test_the_adjoint_takes_a_twist_through_a_transform(rng):
    T, twist = motion(rng, 77, 3), rng.normal(size=6) * 0.1
    np.testing.assert_allclose(
        se3.exp(se3.adjoint(T) @ twist), T @ se3.exp(twist) @ se3.inverse(T), atol=1e-13
    )


@pytest.mark.parametrize('size', [1.0, 3e-4])
def test_a_transposed_transform_is_refused(rng, size):
    with pytest.raises(InvalidTransform, match='last row'):
        se3.checked_transform(motion(rng, 77, size).T)


def test_a_complex_transform_is_refused():
    with pytest.raises(InvalidTransform, match='complex'):
        se3.checked_transform(np.eye(4) * 1j)


def test_a_rotation_with_few_digits_is_made_orthonormal(rng):
    T = motion(rng, 30, 1)
    checked = se3.checked_transform(np.round(T, 4))
    np.testing.assert_allclose(checked[:3, :3] @ checked[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(checked, T, atol=2e-4)
