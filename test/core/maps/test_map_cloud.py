from threading import Event

import numpy as np
import pytest
from clouds import error_of
from terrain import guess_near, points_around, scan_at

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    MapCloud,
    RegistrationConfig,
    Status,
    Verdict,
    register,
)
from idem_ros.core.geometry import se3
from idem_ros.core.maps.point_blocks import PointBlocks

REACH = 30.0  # of a scan
BEYOND = REACH + 80.0  # voxels of 1.0 from all of its points
CONFIG = RegistrationConfig(voxel_size=1.0)
HERE = (40.0, -30.0)


@pytest.fixture(scope='module')
def terrain():
    return points_around(HERE, 200.0, np.random.default_rng(1))


@pytest.fixture(scope='module')
def scan():
    """Points, truth and guess of a scan."""
    rng = np.random.default_rng(2)
    points, truth = scan_at(HERE, REACH, rng)
    return points, truth, guess_near(truth, rng)


def bits_of(result):
    said = result.assessment
    numbers = (result.q_tot, result.overlap, result.radius, said.p_aligned, said.basin)
    return [
        result.T_target_source.tobytes(),
        result.information.tobytes(),
        said.covariance.tobytes(),
        np.array(numbers).tobytes(),
        said.reason,
    ]


def test_a_scan_finds_its_place_in_a_map_as_in_a_cloud(terrain, scan):
    points, truth, guess = scan
    for target in (MapCloud(terrain), Cloud(terrain)):
        result = register(target, points, guess, CONFIG)
        degrees, distance = error_of(result.T_target_source, truth)
        assert result.converged
        assert degrees < 0.05
        assert distance < 0.03
        assert result.overlap == result.overlap_source > 0.9


@pytest.mark.parametrize('voxel_size', [None, 'auto', 0.7])
def test_a_scan_finds_its_place_at_any_voxel_size(terrain, scan, voxel_size):
    points, truth, guess = scan
    config = RegistrationConfig(voxel_size=voxel_size)
    result = register(MapCloud(terrain), points, guess, config)
    degrees, distance = error_of(result.T_target_source, truth)
    assert degrees < 0.05
    assert distance < 0.03
    assert result.assessment.verdict is Verdict.ALIGNED


def test_what_was_prepared_before_changes_no_bit(terrain, scan):
    points, _, guess = scan
    fresh = bits_of(register(MapCloud(terrain), points, guess, CONFIG))
    used, small = MapCloud(terrain), MapCloud(terrain, cache_bytes=100_000)
    for some in (used, small):
        register(some, points, se3.translation((50.0, 20.0, 0.0)) @ guess, CONFIG)
        assert bits_of(register(some, points, guess, CONFIG)) == fresh
    assert bits_of(register(used, points, guess, CONFIG)) == fresh
    assert small.bytes < 300_000


def test_threads_change_no_bit(terrain, scan):
    points, _, guess = scan
    two = RegistrationConfig(voxel_size=1.0, threads=2)
    alone = register(MapCloud(terrain), points, guess, CONFIG)
    assert bits_of(register(MapCloud(terrain), points, guess, two)) == bits_of(alone)


@pytest.mark.parametrize('voxel_size', [1.0, None])
def test_what_a_map_holds_beyond_reach_changes_no_bit(terrain, scan, voxel_size):
    points, _, guess = scan
    config = RegistrationConfig(voxel_size=voxel_size)
    far = np.abs(terrain[:, :2] - HERE).max(axis=1) > BEYOND
    garbage = [[1e9, 0.0, 0.0], [np.nan, 0.0, 0.0], [0.0, np.inf, 0.0], [-4e8, 4e8, 1e3]]
    whole = bits_of(register(MapCloud(terrain), points, guess, config))
    assert bits_of(register(MapCloud(terrain[~far]), points, guess, config)) == whole
    more = np.concatenate([garbage, terrain, terrain[far] + (0.3, 0.2, 0.1)])
    assert bits_of(register(MapCloud(more), points, guess, config)) == whole


@pytest.mark.parametrize(('share', 'far'), [(0.0, 1e9), (0.05, 1e9), (0.02, 1e5), (0.01, 2e3)])
@pytest.mark.parametrize('voxel_size', [1.0, 'auto'])
def test_strays_of_a_scan_are_left_out(terrain, scan, voxel_size, share, far):
    points, _, guess = scan
    config, n = RegistrationConfig(voxel_size=voxel_size), max(int(share * len(points)), 1)
    strays = far * np.random.default_rng(9).uniform(0.5, 1.0, (n, 3))
    clean = register(MapCloud(terrain), points, guess, config)
    thrown = register(MapCloud(terrain), np.concatenate([points, strays]), guess, config)
    np.testing.assert_allclose(thrown.T_target_source, clean.T_target_source, atol=1e-6)
    assert thrown.overlap == clean.overlap
    assert thrown.assessment.reason == clean.assessment.reason
    assert thrown.assessment.basin == pytest.approx(clean.assessment.basin, rel=1e-6)


def test_points_of_a_scan_that_are_only_far_do_not_throw_the_verdict(terrain, scan):
    points, truth, guess = scan
    strays = np.random.default_rng(9).uniform(-8.0, 8.0, (len(points) // 100, 3)) * REACH
    result = register(MapCloud(terrain), np.concatenate([points, strays]), guess, CONFIG)
    degrees, distance = error_of(result.T_target_source, truth)
    assert degrees < 0.05
    assert distance < 0.05
    assert result.assessment.verdict is Verdict.ALIGNED
    assert result.assessment.basin < 1.0


def test_what_is_prepared_ahead_changes_no_bit_and_is_not_made_again(terrain, scan):
    points, _, guess = scan
    fresh = bits_of(register(MapCloud(terrain), points, guess, CONFIG))
    source = Counting(terrain)
    some = MapCloud(source)
    register(some, points, se3.translation((150.0, 100.0, 0.0)) @ guess, CONFIG)
    some.prefetch((*HERE, 0.0), 150.0).result(timeout=60)
    asked = source.asked
    assert bits_of(register(some, points, guess, CONFIG)) == fresh
    assert source.asked == asked


def test_a_later_place_takes_the_turn_of_an_earlier_one(terrain, scan):
    points, _, guess = scan
    places, asked = [(x, 60.0, 0.0) for x in (-100.0, 0.0, 100.0)], []
    for is_patient in (True, False):
        source = Counting(terrain)
        some = MapCloud(source)
        register(some, points, guess, CONFIG)
        before = source.asked
        if not is_patient:
            source.goes_on.clear()  # the first place has begun when the last one is named
        waiting = []
        for place in places:
            waiting.append(some.prefetch(place, 40.0))
            if is_patient:
                waiting[-1].result(timeout=60)
        source.goes_on.set()
        for each in waiting:
            each.result(timeout=60)
        asked.append(source.asked - before)
    assert 0 < asked[1] < asked[0]


def test_a_scan_that_ends_far_from_its_guess_meets_what_is_there(terrain):
    rng = np.random.default_rng(5)
    points, truth = scan_at(HERE, 100.0, rng)
    turned = truth @ se3.exp(np.array([0.0, 0.0, np.radians(12.0), 0.0, 0.0, 0.0]))
    near = register(MapCloud(terrain), points, truth, CONFIG)
    far = register(MapCloud(terrain), points, turned, CONFIG)
    degrees, distance = error_of(far.T_target_source, truth)
    assert degrees < 0.05
    assert distance < 0.05
    assert far.overlap == pytest.approx(near.overlap, rel=1e-3)
    assert far.assessment.basin > near.assessment.basin


def test_a_scan_outside_the_map_is_separated_at_once(terrain, scan):
    points, _, guess = scan
    source = Counting(terrain)
    result = register(MapCloud(source), points, se3.translation((900.0, 0, 0)) @ guess, CONFIG)
    assert result.status is Status.NO_OVERLAP
    assert result.assessment.verdict is Verdict.SEPARATED
    assert 'the map lies from (-160' in result.assessment.reason
    assert not result.is_usable


def test_a_map_of_another_unit_is_named_as_such(terrain, scan):
    points, _, guess = scan
    result = register(MapCloud(1e-3 * terrain), points, guess, CONFIG)
    assert result.assessment.verdict is Verdict.SEPARATED
    assert 'the same unit?' in result.assessment.reason


def test_far_coordinates_lose_no_millimetre(terrain, scan):
    points, _, guess = scan
    offset = np.array([4.0e5, 5.0e6, 300.0])
    near = register(MapCloud(terrain), points, guess, CONFIG)
    far = register(MapCloud(terrain + offset), points, se3.translation(offset) @ guess, CONFIG)
    back = se3.translation(-offset) @ far.T_target_source
    _, distance = error_of(back, near.T_target_source)
    assert distance < 1e-3


def test_a_map_is_no_source(terrain, scan):
    with pytest.raises(InvalidCloud, match='can only be the target'):
        register(scan[0], MapCloud(terrain))


@pytest.mark.parametrize('points', [np.full((4, 3), np.nan), np.zeros((4, 2)), 'map.pcd'])
def test_no_map_is_made_of_what_is_none(points):
    with pytest.raises(InvalidCloud):
        MapCloud(points)


class Counting(PointBlocks):
    """A source that tells how often it was asked, and answers when it may go on."""

    def __init__(self, points):
        super().__init__(points)
        self.asked, self.goes_on = 0, Event()
        self.goes_on.set()

    def points_within(self, low, high):
        self.asked += 1
        assert self.goes_on.wait(60.0)
        return super().points_within(low, high)
