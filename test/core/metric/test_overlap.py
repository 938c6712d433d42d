import numpy as np
import pytest
from terrain import guess_near, points_around, scan_at

from idem_ros.core import Cloud, RegistrationConfig, Verdict, register
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.metric.overlap import overlap_of

CONFIG = RegistrationConfig(voxel_size=1.0)
SIDE = 30.0


def counts(target, source, radius):
    """How many points of the other are near each, by all distances."""
    near = np.linalg.norm(target[:, None] - source[None], axis=2) <= radius
    return near.sum(axis=1).astype(float), near.sum(axis=0).astype(float)


def overlap_at(target, source, radius=0.3, T=None):
    T = np.eye(4) if T is None else T
    clouds = Cloud(target), Cloud(source)
    reach = counts(target, se3.transform_points(T, source), radius)
    return overlap_of(*clouds, between_origins(*clouds, T), radius, reach)


def sheet(rng, n, low, high):
    return np.column_stack([rng.uniform(low, high, (n, 2)), np.zeros(n)])


def test_of_two_clouds_alike_it_is_the_share_of_all_points(rng):
    target, source = sheet(rng, 500, 0.0, 4.0), sheet(rng, 300, 1.0, 5.0)
    found = overlap_at(target, source)
    reach = counts(target, source, 0.3)
    assert found.share == np.mean(np.concatenate(reach) > 0)
    assert found.of_source == np.mean(reach[1] > 0)
    back = overlap_at(source, target)
    assert (found.share, found.most) == (back.share, back.most)
    assert found.most == max(np.mean(each > 0) for each in reach)


def test_of_a_scan_in_a_map_it_is_the_share_of_the_scan_from_either_side(rng):
    wide, scan = sheet(rng, 4000, -20.0, 20.0), sheet(rng, 300, 1.0, 5.0)
    T = se3.exp(np.array([0.0, 0.0, 0.7, 2.0, -1.0, 0.0]))
    reach = counts(wide, se3.transform_points(T, scan), 0.3)
    forth, back = overlap_at(wide, scan, T=T), overlap_at(scan, wide, T=se3.inverse(T))
    assert forth.share == forth.most == forth.of_source == np.mean(reach[1] > 0)
    assert back.share == back.most == np.mean(reach[1] > 0)
    inside = np.abs(se3.transform_points(se3.inverse(T), wide)[:, :2] - 3.0).max(axis=1) < 2.3
    assert forth.of_target == pytest.approx(np.mean(reach[0][inside] > 0), abs=0.1)


def test_a_cloud_far_denser_than_a_scan_of_the_same_place_is_a_map(rng):
    dense, scan = sheet(rng, 4000, 0.0, 4.0), sheet(rng, 100, 0.0, 4.0)
    forth, back = overlap_at(dense, scan, radius=0.05), overlap_at(scan, dense, radius=0.05)
    assert forth.in_map
    assert forth.share == back.share == np.mean(counts(dense, scan, 0.05)[1] > 0) > 0.8


def test_clouds_that_meet_at_a_rim_are_no_maps(rng):
    left, right = sheet(rng, 500, (-4.0, 0.0), (0.0, 4.0)), sheet(rng, 400, (0.0, 0.0), (4.0, 4.0))
    found = overlap_at(left, right)
    assert found.share == np.mean(np.concatenate(counts(left, right, 0.3)) > 0)
    assert found.share < 0.1


def test_a_stray_does_not_stretch_the_extent(rng):
    wide, scan = sheet(rng, 4000, -20.0, 20.0), sheet(rng, 300, 1.0, 5.0)
    strayed = np.concatenate([scan, [[1e6, 0.0, 0.0]]])
    assert overlap_at(wide, strayed).of_target == pytest.approx(
        overlap_at(wide, scan).of_target, abs=0.02
    )


def test_clouds_that_do_not_meet_have_none(rng):
    found = overlap_at(sheet(rng, 50, 0.0, 1.0), sheet(rng, 50, 9.0, 10.0))
    assert found == (0.0, 0.0, 0.0, 0.0, False)


def test_a_cloud_however_much_larger_than_the_scan_is_aligned():
    rng = np.random.default_rng(4)
    terrain = points_around((0.0, 0.0), 200.0, rng, density=1.0)
    for middle in ((0.0, 0.0), (-100.0, 60.0)):
        points, truth = scan_at(middle, SIDE, rng)
        result = register(terrain, points, guess_near(truth, rng), CONFIG)
        assert result.assessment.verdict is Verdict.ALIGNED
        assert result.overlap == result.overlap_source > 0.9
        assert result.overlap_target > 0.7
        assert np.linalg.norm(result.T_target_source[:3, 3] - truth[:3, 3]) < 0.05


def test_a_scan_of_which_little_meets_the_map_is_low_overlap():
    rng = np.random.default_rng(4)
    terrain = points_around((0.0, 0.0), 60.0, rng)
    points, truth = scan_at((117.0, 0.0), 58.0, rng)
    result = register(terrain, points, truth, RegistrationConfig(voxel_size=1.0, mode='audit'))
    assert 0.0 < result.overlap_source < 0.05
    assert result.assessment.verdict is Verdict.LOW_OVERLAP
