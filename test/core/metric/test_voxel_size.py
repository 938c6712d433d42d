from dataclasses import replace

import numpy as np
import pytest

from idem_ros.core import Cloud, InvalidConfig, RegistrationConfig, register
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.se3 import inverse
from idem_ros.core.metric.voxel_size import common_voxel_size, edge, fit_of, with_voxel_size
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.surfaces import Scene, box


def ringed(rng, rings, beams=1800, noise=0.005, shift=0.0):
    """A room of 8 x 8 m seen by a spinning LiDAR of some rings."""
    around = np.linspace(0, 2 * np.pi, beams, endpoint=False)
    ways = np.stack([np.cos(around), np.sin(around)], -1)
    reach = np.min(np.abs((np.where(ways > 0, 4.0, -4.0) - [shift, 0]) / (ways + 1e-12)), axis=1)
    slopes = np.linspace(-0.3, 0.3, rings)
    walls = [np.c_[reach[:, None] * ways, slope * reach] for slope in slopes]
    points = np.vstack(walls)
    return points + noise * rng.normal(size=points.shape)


def walls(rng, n, noise, edge_length=8.0):
    """Points anywhere on three walls."""
    points = edge_length * rng.random((n, 3))
    points[np.arange(n), rng.integers(0, 3, n)] = 0.0
    return points + noise * rng.normal(size=(n, 3))


def size_of(*clouds):
    config = with_voxel_size(RegistrationConfig(), *map(Cloud, clouds))
    return config.voxel_size


def test_the_size_does_not_depend_on_which_cloud_is_the_target(rng):
    one, other = walls(rng, 30_000, 0.01), walls(rng, 90_000, 0.02)
    assert size_of(one, other) == size_of(other, one)


def test_the_size_is_a_step_of_the_ladder_and_of_some_thousand_voxels(rng):
    cloud = walls(rng, 60_000, 0.005)
    size = size_of(cloud, cloud)
    assert 2 * np.log2(size) == pytest.approx(round(2 * np.log2(size)))
    assert 1_500 < len(Cloud(cloud).reduced(size)) < 15_000


def test_the_size_follows_the_unit_of_length(rng):
    cloud = walls(rng, 60_000, 0.005)
    assert size_of(cloud / 1024, cloud / 1024) == pytest.approx(size_of(cloud, cloud) / 1024)


def test_noise_asks_for_larger_voxels(rng):
    clean, noisy = (walls(rng, 60_000, noise) for noise in (0.001, 0.03))
    assert size_of(noisy, noisy) > size_of(clean, clean)


@pytest.mark.parametrize('rings', [8, 12, 16])
def test_rings_of_a_lidar_ask_for_voxels_that_reach_from_one_to_the_next(rng, rings):
    apart = 0.6 / (rings - 1) * 4.0
    cloud = ringed(rng, rings)
    assert 0.7 * apart < size_of(cloud, cloud) < 3.0 * apart


def test_a_map_keeps_the_size_that_its_scans_ask_for(rng):
    whole = walls(rng, 400_000, 0.01, edge_length=40.0)
    scans = [whole[np.linalg.norm(whole - at, axis=1) < 10.0] for at in ([5, 5, 0], [9, 4, 0])]
    sizes = {size_of(whole, scan[::2]) for scan in scans}
    assert len(sizes) == 1
    assert sizes == {size_of(scans[0][::2], scans[0][::2])}


def test_scans_of_a_sensor_share_a_size(rng):
    sizes = [size_of(*(ringed(rng, 64, shift=x) for x in (x, x + 0.1))) for x in (0.0, 0.1, 0.2)]
    assert len(set(sizes)) == 1


def test_few_points_are_taken_as_given(rng):
    assert size_of(walls(rng, 1_600, 0.001), walls(rng, 1_600, 0.001)) is None


@pytest.mark.parametrize(
    'points',
    [
        np.ones((1, 3)),
        np.zeros((9_000, 3)),
        np.repeat(np.eye(3), 3_000, axis=0),
        np.linspace(0, 1, 9_000)[:, None] * np.ones(3),
        np.vstack([1e-7 * np.arange(30_000).reshape(-1, 3), np.full((3, 3), 1e11)]),
    ],
    ids=['one', 'all in one place', 'three places', 'a line', 'strays'],
)
def test_clouds_of_no_size_are_answered_in_bounded_time(points):
    for other in (points, np.random.default_rng(0).random((9_000, 3))):
        size = size_of(points, other)
        assert size is None or size > 0.0


def test_strays_do_not_set_the_size(rng):
    cloud = walls(rng, 60_000, 0.005)
    strayed = np.vstack([cloud, [[1e6, 0.0, 0.0], [0.0, -1e9, 3.0]]])
    assert size_of(strayed, strayed) == size_of(cloud, cloud)


def test_of_a_much_finer_cloud_and_a_coarser_one_the_coarsest_of_the_finer_is_taken(rng):
    small, large = (fit_of(walls(rng, 20_000, 0.0, length) - length / 3) for length in (1.0, 1e3))
    assert common_voxel_size(small, large) == edge(small.coarsest)


def test_the_result_says_the_size_and_is_the_one_of_that_size(rng):
    target, source = ringed(rng, 64), ringed(rng, 64, shift=0.1)
    found = register(target, source)
    assert found.voxel_size == size_of(target, source)
    fixed = register(target, source, config=RegistrationConfig(voxel_size=found.voxel_size))
    np.testing.assert_array_equal(found.T_target_source, fixed.T_target_source)
    as_given = register(target[::20], source[::20], config=RegistrationConfig(voxel_size=None))
    assert as_given.voxel_size is None


def test_the_other_way_round_it_ends_in_the_inverse(rng):
    target, source = ringed(rng, 64), ringed(rng, 64, shift=0.1)
    there, back = register(target, source), register(source, target)
    assert there.voxel_size == back.voxel_size
    np.testing.assert_allclose(inverse(back.T_target_source), there.T_target_source, atol=1e-3)


def test_a_cloud_is_looked_at_once(rng):
    cloud = Cloud(walls(rng, 20_000, 0.01))
    assert cloud.voxel_fit() is cloud.voxel_fit()


def test_a_size_that_is_given_stays(rng):
    config = RegistrationConfig(voxel_size=0.3)
    assert with_voxel_size(config, None, None) is config
    assert with_voxel_size(replace(config, voxel_size=None), None, None).voxel_size is None


@pytest.mark.parametrize('given', ['Auto', 'automatic', '0.5', 0, -1.0, True])
def test_another_word_or_no_length_is_refused(given):
    with pytest.raises(InvalidConfig, match="voxel_size is .* or 'auto'"):
        RegistrationConfig(voxel_size=given)


@pytest.mark.parametrize('copies', [2, 3])
def test_copies_of_points_make_no_finer_voxels(rng, copies):
    points = walls(rng, 6000, 0.005)
    once, often = (common_voxel_size(fit_of(np.repeat(points, k, 0))) for k in (1, copies))
    assert once <= often <= 2 * once


@pytest.mark.parametrize(('rings', 'noise'), [(8, 0.01), (8, 0.02), (16, 0.02)])
def test_rings_that_noise_spreads_along_their_rays_are_no_surfaces(rings, noise):
    inner, outer = np.array([3.0, 3.0, 1.4]), np.array([4.0, 4.0, 2.4])
    sides = [(axis, sign) for axis in range(3) for sign in (-1.0, 1.0)]
    low, high = np.tile(-outer, (6, 1)), np.tile(outer, (6, 1))
    for k, (axis, sign) in enumerate(sides):
        (high if sign < 0 else low)[k, axis] = sign * inner[axis]
    walls_ = Scene(boxes=[box(*ends) for ends in zip(low, high, strict=True)])
    lidar = Lidar(rings=rings, azimuth_steps=900, range_noise_m=noise)
    for seed in range(4):
        cloud = scan(walls_, se3.translation([0.3, 0.2, 0.0]), lidar, np.random.default_rng(seed))
        assert size_of(cloud, cloud) > 0.17
