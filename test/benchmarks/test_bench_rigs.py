import numpy as np
import pytest

from benchmarks.rigs.captures import FOLDER, NAMES, captures_starts
from benchmarks.rigs.measure import FAR, LEVELS, NEAR, Error, rig_goals, rigs_table
from benchmarks.rigs.scenes import OVERLAP, overlaps, rig_scene
from idem_ros.core.geometry import se3


def test_sensors_of_a_rig_overlap_as_they_should_and_starts_are_off_by_as_much():
    scene = rig_scene(1, 1, [NEAR, FAR])
    clouds = [cloud.points + cloud.origin for cloud in scene.instants[0].clouds]
    found = overlaps(clouds, scene.truth)
    assert np.sum(found >= OVERLAP[0]) >= 2 * (len(clouds) - 1)
    assert found.max() <= OVERLAP[1]
    for (degrees, metres), starts in scene.starts.items():
        np.testing.assert_allclose(starts[0], np.eye(4), atol=1e-12)
        off = se3.inverse(scene.truth[1]) @ starts[1]
        assert np.degrees(se3.rotation_angle(off)) == pytest.approx(degrees)
        assert np.linalg.norm(starts[1, :3, 3] - scene.truth[1, :3, 3]) == pytest.approx(metres)


def test_goals_are_missed_by_sensors_that_ended_elsewhere():
    right, wrong = Error(0, 0.002, 0.01, 1.0, True), Error(1, 3.0, 40.0, 1.0, False)
    found = {key: [right] * 99 + [wrong] for key in LEVELS}
    assert all(goal.reached for goal in rig_goals(found))
    found = {key: [right] * 9 + [wrong] for key in LEVELS}
    assert not any(goal.reached for goal in rig_goals(found) if 'failures' in goal.figure)
    assert '90.0%' in rigs_table(found)


def test_the_nominal_extrinsics_are_read(shared_data):
    if not FOLDER.is_dir():
        pytest.skip(f'the captures are not in {shared_data}')
    starts = captures_starts('0001')
    assert len(starts) == len(NAMES)
    np.testing.assert_allclose(starts[1][:3, 0], (0, 1, 0), atol=1e-12)
    assert starts[1][1, 3] == pytest.approx(0.6258, abs=1e-4)
