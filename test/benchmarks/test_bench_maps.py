import numpy as np
import pytest

from benchmarks.maps.from_disk import FromDisk
from benchmarks.maps.from_disk import measure as measure_from_disk
from benchmarks.maps.measure import VOXEL, Drive, Figures, goals, scan_at
from benchmarks.maps.town import LOT, Town, height, points_of, scene_around
from idem_ros.core import RegistrationConfig, Verdict
from idem_ros.simulation.raycast import cast


def test_a_box_of_the_town_holds_its_points_whichever_box_is_asked_for():
    town = Town(300_000)
    low, high = np.array([-30.0, -20.0, -10.0]), np.array([50.0, 45.0, 30.0])
    whole = town.points_within(*town.bounds)
    inside = whole[((whole >= low) & (whole < high)).all(axis=1)]
    np.testing.assert_array_equal(town.points_within(low, high), inside)
    assert len(whole) == pytest.approx(300_000, rel=0.25)
    assert len(town.points_within(high + 1e4, high + 2e4)) == 0


def test_a_lot_has_the_same_points_whenever_it_is_asked():
    points_of.cache_clear()
    first = points_of(3, -2)
    points_of.cache_clear()
    np.testing.assert_array_equal(points_of(3, -2), first)
    assert np.abs(first[:, 0] - 3.5 * LOT).max() < LOT


def test_a_ray_hits_the_ground_at_the_height_of_the_map(rng):
    scene = scene_around(0.0, 0.0, 20.0)
    for x, y in rng.uniform(-3.0, 3.0, (20, 2)):
        above = np.array([x, y, height(x, y) + 1.5])
        (distance,) = cast(scene, above, np.array([[0.0, 0.0, -1.0]]), 10.0)
        assert distance == pytest.approx(1.5, abs=1e-6)


def test_a_figure_is_missed_where_right_results_are_not_aligned():
    few, many = (
        Figures(m, idem_ms=np.full(5, ms), idem_errors=np.full((50, 2), 1e-3), verdicts=verdicts)
        for m, ms, verdicts in (
            (0.2, 10.0, [Verdict.ALIGNED] * 50),
            (50.0, 11.0, [Verdict.ALIGNED] * 48 + [Verdict.LOW_OVERLAP] * 2),
        )
    )
    drive = Drive(np.full(9, 20.0), np.full((9, 2), 1e-3), [Verdict.ALIGNED] * 9)
    disk = (
        FromDisk('file', 10**6, 1.0, 0.1, 10**8, 0.001),
        FromDisk('tiles', 10**6, 1, 1, 10**8, 0),
    )
    found = [*goals([few, many], drive, 3.0, disk)]
    assert [goal.figure for goal in found if not goal.reached] == [
        'not aligned, of 100 right results',
        'low_overlap, of 100 results',
    ]
    assert found[0].measured == pytest.approx(1.1)


def test_a_map_of_a_file_and_of_tiles_gives_the_pose_of_each_scan():
    scans = [scan_at(x, 1.6, 0.0, 0) for x in (-20.0, 20.0)]
    file, tiles = measure_from_disk(0.2, scans, RegistrationConfig(voxel_size=VOXEL))
    assert file.points == tiles.points > 100_000
    assert max(file.worst_m, tiles.worst_m) < 0.01
    assert min(file.bytes, file.first_s, tiles.other_s) > 0
