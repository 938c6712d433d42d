import numpy as np
import pytest
from clouds import motion

from idem_ros.core import InvalidConfig, InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.simulation.lidar import Lidar, ray_directions, scan
from idem_ros.simulation.surfaces import Scene, box

BALL = Scene(spheres=[(0.0, 0.0, 0.0, 10.0)])  # seen from its middle, every range is 10 m
ROOM = Scene(boxes=[box((-5, -4, -2), (5, 4, 3))])
EXACT = Lidar(range_noise_m=0.0, dropout=0.0, min_range_m=0.0)


def test_a_scan_without_noise_lies_on_the_surfaces(rng):
    T = motion(rng, 40, 1.0)
    points = se3.transform_points(T, scan(ROOM, T, EXACT, rng))
    assert len(points) == EXACT.rings * EXACT.azimuth_steps
    to_faces = np.abs(np.concatenate([points - (-5, -4, -2), points - (5, 4, 3)], axis=1))
    assert to_faces.min(axis=1).max() < 1e-6


def test_the_noise_is_along_the_ray_and_has_the_stated_deviation(rng):
    points = scan(BALL, np.eye(4), Lidar(range_noise_m=0.05, dropout=0.0), rng)
    errors = np.linalg.norm(points, axis=1) - 10.0
    assert errors.std() == pytest.approx(0.05, rel=0.03)
    assert abs(errors.mean()) < 0.002


def test_the_stated_share_drops_out(rng):
    lidar = Lidar(dropout=0.2)
    share = len(scan(BALL, np.eye(4), lidar, rng)) / (lidar.rings * lidar.azimuth_steps)
    assert share == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize('limits', [{'min_range_m': 11.0}, {'max_range_m': 9.0}])
def test_surfaces_out_of_range_give_no_return(rng, limits):
    assert len(scan(BALL, np.eye(4), Lidar(**limits), rng)) == 0


def test_a_seed_gives_the_same_points_to_the_bit():
    first, again, other = (
        scan(ROOM, np.eye(4), Lidar(), np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_rays_are_unit_vectors_from_the_lowest_ring_up():
    lidar = Lidar(rings=4, azimuth_steps=10, lowest_deg=-30, highest_deg=15)
    directions = ray_directions(lidar)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_allclose(np.degrees(np.arcsin(directions[::10, 2])), [-30, -15, 0, 15])
    np.testing.assert_allclose(directions[20], (1, 0, 0), atol=1e-15)


@pytest.mark.parametrize(
    'wrong',
    [
        {'rings': 0},
        {'lowest_deg': 20.0},
        {'range_noise_m': -0.1},
        {'dropout': 1.5},
        {'min_range_m': 60.0},
    ],
)
def test_a_sensor_that_cannot_be_is_refused(wrong):
    with pytest.raises(InvalidConfig, match=next(iter(wrong)).split('_')[0]):
        Lidar(**wrong)


def test_a_pose_that_is_no_pose_is_refused(rng):
    with pytest.raises(InvalidTransform, match='T_world_sensor'):
        scan(ROOM, 2 * np.eye(4), Lidar(), rng)
