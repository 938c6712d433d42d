import numpy as np
import pytest

from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.core.geometry import se3
from idem_ros.core.trust.residuals import GROWING, TURNING, _over_time
from idem_ros.simulation.lidar import Lidar, moving_scan, scan
from idem_ros.simulation.room import room

TWIST = np.array([3.0, 0.1, 0.0, 0.02, -0.03, 0.9])


@pytest.fixture(scope='module')
def scans():
    """A target, what a sensor in motion sees, its times, and what one sees that stands still."""
    rng, lidar = np.random.default_rng(7), Lidar(azimuth_steps=600)
    scene = room(rng)
    x, y, _ = scene.route[40]
    poses = [se3.translation((x + off, y, 1.2)) for off in (0.0, 0.4)]
    target = scan(scene, poses[0], lidar, rng)
    swept = moving_scan(scene, poses[1], TWIST, 0.1, lidar, rng)
    return target, *swept, scan(scene, poses[1], lidar, rng), se3.translation((0.4, 0.0, 0.0))


def test_a_smear_that_was_not_undone_is_named_in_the_reason(scans):
    target, points, _, _, guess = scans
    result = register(target, points, guess, RegistrationConfig(voxel_size=0.25))
    assert TURNING in result.assessment.reason


def test_a_smear_leaves_the_pose_as_unsure_as_the_sensor_moved(scans):
    target, points, _, still, guess = scans
    config = RegistrationConfig(voxel_size=0.25)
    smeared, clear = (
        np.sqrt(np.diag(register(target, cloud, guess, config).assessment.covariance))
        for cloud in (points, still)
    )
    half = 0.05 * TWIST  # of the sweep's motion, to its begin or its end
    assert 0.3 * half[0] < smeared[0] < 3.0 * half[0]
    assert 0.3 * half[5] < smeared[5] < 3.0 * half[5]
    assert clear[0] < 0.1 * half[0]


def test_a_scan_of_a_sensor_that_stood_still_is_not_suspected(scans):
    target, _, _, still, guess = scans
    result = register(target, still, guess, RegistrationConfig(voxel_size=0.25))
    assert TURNING not in result.assessment.reason


@pytest.mark.parametrize('motion', ['guess', 'solve'])
def test_nor_is_one_whose_motion_was_undone(scans, motion):
    target, points, times, _, guess = scans
    config = RegistrationConfig(voxel_size=0.25, motion=motion)
    twist = TWIST if motion == 'guess' else None
    result = register(target, Cloud(points, times), guess, config, twist=twist)
    assert TURNING not in result.assessment.reason


def test_half_a_scan_has_no_azimuth_to_turn_with(scans):
    target, points, _, _, guess = scans
    ahead = points[points[:, 0] > 0.0]
    result = register(target, ahead, guess, RegistrationConfig(voxel_size=0.25))
    assert TURNING not in result.assessment.reason


@pytest.mark.parametrize('scale', [0.995, 1.005, 1.01])
def test_a_wrong_scale_is_named_in_the_reason(scans, scale):
    target, _, _, still, guess = scans
    result = register(target, scale * still, guess, RegistrationConfig(voxel_size=0.25))
    assert GROWING in result.assessment.reason


def test_the_same_scale_is_not_suspected_nor_is_a_smear_taken_for_one(scans):
    target, points, _, still, guess = scans
    for source in (still, points):
        result = register(target, source, guess, RegistrationConfig(voxel_size=0.25))
        assert GROWING not in result.assessment.reason


@pytest.mark.parametrize('k', [1, 4, 6])
def test_the_poses_at_both_ends_are_linearised_by_the_regions_times(rng, k):
    pulls, half, held = rng.normal(size=(30, 6)), rng.normal(size=(30, 6, 6)), np.eye(6)[:, :k]
    held = held + 0.1 * rng.normal(size=held.shape)
    stiffness, time = half @ half.transpose(0, 2, 1), rng.uniform(-0.5, 0.5, 30)
    J = [np.hstack([held, t * held]) for t in time]
    matrix, gradient = _over_time(pulls, stiffness, time, held)
    expected = sum(j.T @ S @ j for j, S in zip(J, stiffness, strict=True))
    np.testing.assert_allclose(matrix, expected, rtol=1e-9, atol=1e-9)
    pull = sum(j.T @ g for j, g in zip(J, pulls, strict=True))
    np.testing.assert_allclose(gradient, pull, rtol=1e-9, atol=1e-9)
