import numpy as np
import pytest

from benchmarks.smooth.drives import STEP_DEG, STEP_M, drifted, ground
from benchmarks.smooth.maps import correlations, map_goals, maps_table
from benchmarks.smooth.measure import Driven, drive_goals
from idem_ros.core.geometry import se3
from idem_ros.files.trajectory_file import read_trajectory


def test_every_step_of_the_odometry_is_off_by_as_much(rng):
    truth = np.array([se3.translation((float(k), 0.0, 0.0)) for k in range(5)])
    odometry = drifted(truth, rng)
    for k in range(4):
        step = se3.inverse(odometry[k]) @ odometry[k + 1]
        off = step[:3, 3] - (1.0, 0.0, 0.0)
        assert np.linalg.norm(off) == pytest.approx(STEP_M)
        assert np.degrees(se3.rotation_angle(step)) == pytest.approx(STEP_DEG, rel=1e-3)


def test_a_long_way_over_ground_is_recorded_with_its_odometry(tmp_path):
    recorded = ground(tmp_path, 0, 5)
    found = read_trajectory(recorded.trajectory)
    np.testing.assert_allclose(found.poses, recorded.odometry, atol=1e-9)
    np.testing.assert_allclose(recorded.truth[0], np.eye(4), atol=1e-12)


def test_the_score_is_held_to_a_correlation_and_to_that_of_the_entropy():
    noise = np.linspace(0.01, 0.1, 12)
    rows = [('room', 1, float(x), float(x), float((k * 5) % 12)) for k, x in enumerate(noise)]
    assert correlations(rows)[0] == 1.0
    assert [goal.reached for goal in map_goals(rows)] == [True, True]
    others = [(*row[:3], row[4], row[3]) for row in rows]
    assert [goal.reached for goal in map_goals(others)] == [False, False]
    assert '| room alone |' in maps_table(rows)


def test_of_drives_the_worst_counts():
    driven = [
        Driven(k, 10.0 * k, 15.0, (1.0, 1.0), (0.1 * k, 0.2), loops=3, record={})
        for k in (1, 2, 4)
    ]
    assert [goal.measured for goal in drive_goals(driven)] == [40.0, 15.0, 0.4, 0.2]
