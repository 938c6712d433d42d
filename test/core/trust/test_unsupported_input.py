import numpy as np
import pytest
from clouds import motion

from idem_ros.core import RegistrationConfig, Verdict, register
from idem_ros.core.geometry.se3 import inverse, transform_points

UTM = np.array([431234.5, 5412345.6, 312.0])
CONFIG = RegistrationConfig(voxel_size=0.1)


def closed_room(rng, count=12000):
    """Six walls of 6 x 5 x 3 m, a ball in it; with noise of 3 mm."""
    each, size = count // 7, np.array([6.0, 5.0, 3.0])
    parts = []
    for axis in range(3):
        for side in (0.0, 1.0):
            wall = rng.random((each, 3)) * size
            wall[:, axis] = side * size[axis]
            parts.append(wall)
    ball = rng.normal(size=(each, 3))
    parts.append(0.7 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + (4.0, 1.5, 1.2))
    points = np.vstack(parts)
    return points + rng.normal(size=points.shape) * 0.003


@pytest.fixture
def truth(rng):
    return motion(rng, 1.0, 0.05)


@pytest.fixture
def room_pair(rng, truth):
    return closed_room(rng), transform_points(inverse(truth), closed_room(rng))


def scan_of_2d(rng):
    """Four walls seen by a scanner in the plane z = 0."""
    k = 600
    walls = [
        np.c_[rng.random(k) * 6, np.zeros(k)],
        np.c_[np.zeros(k), rng.random(k) * 5],
        np.c_[rng.random(k) * 3 + 1, np.full(k, 2.0)],
        np.c_[np.full(k, 4.5), rng.random(k) * 3],
    ]
    xy = np.vstack(walls)
    return np.c_[xy + rng.normal(size=xy.shape) * 0.005, np.zeros(len(xy))]


@pytest.mark.parametrize('voxel_size', [None, 0.05])
@pytest.mark.parametrize('degrees', [0.0, 40.0])
def test_scans_in_one_plane_are_said_to_be_unsupported(rng, voxel_size, degrees):
    tilt = motion(rng, degrees, 1.0)
    target, source = (transform_points(tilt, scan_of_2d(rng)) for _ in range(2))
    said = register(target, source, None, RegistrationConfig(voxel_size=voxel_size)).assessment
    assert 'one plane' in said.reason
    assert np.isnan(said.p_aligned)
    assert said.free == ''
    assert said.verdict is Verdict.NOT_CONVERGED


@pytest.mark.parametrize('voxel_size', [None, 0.05, 0.1])
def test_map_coordinates_in_float32_are_named(room_pair, voxel_size):
    target, source = ((cloud + UTM).astype(np.float32) for cloud in room_pair)
    said = register(target, source, None, RegistrationConfig(voxel_size=voxel_size)).assessment
    assert 'y of the target stands in steps of 0.5' in said.reason
    assert np.isnan(said.p_aligned)


def test_only_the_source_may_be_rounded(room_pair):
    target, source = room_pair
    rounded = (source + UTM).astype(np.float32).astype(np.float64) - UTM
    guess = np.eye(4)
    guess[:3, 3] = -UTM
    said = register(target, rounded + UTM, guess, CONFIG).assessment
    assert 'of the source stands in steps' in said.reason


def test_a_stray_far_off_does_not_make_float32_coarse(room_pair):
    target, source = (cloud.astype(np.float32) for cloud in room_pair)
    source[0] = 1e9, -1e9, 1e9
    assert 'stands in steps' not in register(target, source, None, CONFIG).assessment.reason


def test_map_coordinates_in_doubles_are_in_scope(room_pair):
    target, source = (cloud + UTM for cloud in room_pair)
    assert register(target, source, None, CONFIG).assessment.verdict is Verdict.ALIGNED


def test_float32_near_zero_is_in_scope(room_pair):
    target, source = (cloud.astype(np.float32) for cloud in room_pair)
    assert register(target, source, None, CONFIG).assessment.verdict is Verdict.ALIGNED


@pytest.mark.parametrize('scale', [0.3048, 0.9, 1.05, 1.2, 2.0])
def test_walls_that_meet_walls_at_another_scale_are_not_called_aligned(room_pair, scale):
    target, source = room_pair
    said = register(target, scale * source, None, CONFIG).assessment
    assert said.verdict is not Verdict.ALIGNED
    assert not said.p_aligned >= 0.5


def test_three_walls_of_the_right_scale_are_aligned(rng, truth):
    """They would meet at any scale, but nothing speaks against theirs."""
    corner = [
        cloud[: 6 * (12000 // 7)].reshape(6, -1, 3)[[0, 2, 4]].reshape(-1, 3)
        for cloud in (closed_room(rng), closed_room(rng))
    ]
    source = transform_points(inverse(truth), corner[1])
    assert register(corner[0], source, None, CONFIG).assessment.verdict is Verdict.ALIGNED


def test_a_scan_from_the_other_side_that_sees_half_of_a_thing_is_aligned(rng, truth):
    """Half of what lies within the other's extent meets nothing, and curved surfaces know why."""
    halves = []
    for lowest in (-0.2, -0.2):
        d = rng.normal(size=(12000, 3))
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        side = d[:, 0] if not halves else -d[:, 0]
        bumps = (
            1.0 + 0.15 * np.sin(5 * d[:, :1]) * np.cos(4 * d[:, 1:2]) + 0.1 * np.sin(6 * d[:, 2:])
        )
        halves.append((bumps * d)[side > lowest])
    source = transform_points(inverse(truth), halves[1])
    config = RegistrationConfig(voxel_size=0.05)
    assert register(halves[0], source, truth, config).assessment.verdict is Verdict.ALIGNED


@pytest.mark.parametrize('count', [200, 1000, 5000, 20_000])
@pytest.mark.parametrize('spread', ['normal', 'uniform'])
def test_of_points_that_fill_a_volume_nothing_is_promised(count, spread):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        target, source = (getattr(rng, spread)(size=(count, 3)) for _ in range(2))
        result = register(target, source)
        assert not result.is_usable
        assert not result.assessment.p_aligned >= 0.5


def test_noise_around_a_room_is_not_taken_for_a_volume(room_pair, rng):
    target, source = (
        np.vstack([each, rng.uniform(0, 5, (len(each) // 10, 3))]) for each in room_pair
    )
    assert 'no surfaces' not in register(target, source, config=CONFIG).assessment.reason
