"""Where a scan is looked for in a map that is begun with a pose; maps that come next."""

import numpy as np
import pytest
from pairs import cloud
from terrain import points_around, scan_at

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.maps.open_map import MapPoints
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.map_target import MapTarget
from idem_ros.pairing.pair import Pair
from idem_ros.refinement.refiner import Refiner

CONFIG = RegistrationConfig(voxel_size=0.5)
PLACE = 12.0, -7.0
UP = 300.0  # [m] above sea level


@pytest.fixture(scope='module')
def scan():
    rng = np.random.default_rng(5)
    points, truth = scan_at(PLACE, 35.0, rng)
    return points, se3.translation((0.0, 0.0, UP)) @ truth


@pytest.fixture(scope='module')
def map_points():
    return points_around((0.0, 0.0), 90.0, np.random.default_rng(6)) + (0.0, 0.0, UP)


def pair_of(target, points, T_first, stamp=1):
    guess = Guess(None, T_first=T_first, start=1, lost_after=1.0)
    return Pair(target, cloud(stamp, 'lidar', points), guess)


def clicked(truth):
    """What RViz's 2D Pose Estimate says: no height, no tilt, and half a metre off."""
    pose = se3.translation((truth[0, 3] + 0.4, truth[1, 3] - 0.3, 0.0))
    pose[:2, :2] = truth[:2, :2]
    return pose


def test_a_pose_without_height_is_lifted_to_the_ground_of_the_map(scan, map_points):
    points, truth = scan
    target = MapTarget.of(MapPoints(map_points, 'a map'), 'map')
    refinement = Refiner(CONFIG).refine(pair_of(target, points, clicked(truth)))
    assert abs(refinement.T_guess[2, 3] - truth[2, 3]) < 1.0
    assert refinement.result.assessment.verdict.value == 'aligned'
    assert np.linalg.norm((refinement.result.T_target_source - truth)[:3, 3]) < 0.05


def test_a_pose_off_the_map_stays_as_it_is_and_the_scan_is_separated(scan, map_points):
    points, _ = scan
    target = MapTarget.of(MapPoints(map_points, 'a map'), 'map')
    away = se3.translation((5000.0, 0.0, 0.0))
    refinement = Refiner(CONFIG).refine(pair_of(target, points, away))
    np.testing.assert_array_equal(refinement.T_guess, away)
    assert refinement.result.assessment.verdict.value == 'separated'


def test_a_topic_of_which_most_lies_beyond_the_scan_is_a_map_to_it(scan, map_points):
    points, truth = scan
    target = cloud(1, 'map', map_points)
    refinement = Refiner(CONFIG).refine(pair_of(target, points, truth))
    assert refinement.result.assessment.verdict.value == 'aligned'
    assert refinement.points_target < len(map_points) / 2


def test_of_a_stream_of_wide_scans_none_is_a_map_but_the_first(scan, map_points):
    points, truth = scan
    refiner = Refiner(CONFIG)
    targets = [cloud(i, 'front', map_points) for i in range(1, 4)]
    parts = [
        refiner.refine(pair_of(target, points, truth, stamp=10 + i)).took_part.target.is_part
        for i, target in enumerate(targets)
    ]
    assert parts == [True, False, False]
    again = [refiner.refine(pair_of(targets[-1], points, truth, stamp=20 + i)) for i in (0, 1)]
    assert not any(each.took_part.target.is_part for each in again)
    map_ = cloud(9, 'front', map_points)
    assert refiner.refine(pair_of(map_, points, truth, stamp=30)).took_part.target.is_part


def test_a_map_that_comes_next_is_prepared_around_the_last_scan(scan, map_points):
    points, truth = scan
    refiner, asked = Refiner(CONFIG), []
    refiner.refine(pair_of(MapTarget.of(MapPoints(map_points, 'one'), 'map'), points, truth))

    class Watched(MapPoints):
        def points_within(self, low, high):
            asked.append(1)
            return super().points_within(low, high)

    target = MapTarget.of(Watched(map_points, 'another'), 'map')
    refiner.prepare(target)
    assert asked
    refinement = refiner.refine(pair_of(target, points, truth, stamp=2))
    assert refinement.result.is_usable


def test_utm_coordinates_lose_nothing(scan, map_points):
    points, truth = scan
    utm = se3.translation((4e5, 5e6, 0.0))
    found = []
    for T in (np.eye(4), utm):
        target = MapTarget.of(MapPoints(map_points + T[:3, 3], 'a map'), 'map')
        refinement = Refiner(CONFIG).refine(pair_of(target, points, T @ truth))
        found.append(se3.inverse(T) @ refinement.result.T_target_source)
    np.testing.assert_allclose(*found, rtol=0, atol=2e-3)
