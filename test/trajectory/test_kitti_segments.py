import numpy as np
import pytest
from trajectories import drive

from idem_ros.files.trajectory_file import Trajectory
from idem_ros.trajectory.kitti_segments import LENGTHS, segment_errors


def by_the_devkit(truth, found, lengths):
    """The loops of KITTI's devkit (evaluate_odometry.cpp), line by line."""
    distances = [0.0]
    for before, after in zip(truth, truth[1:], strict=False):
        distances.append(distances[-1] + np.linalg.norm(after[:3, 3] - before[:3, 3]))
    rows = []
    for length in lengths:
        for first in range(0, len(truth), 10):
            last = next(
                (i for i in range(first, len(truth)) if distances[i] > distances[first] + length),
                None,
            )
            if last is None:
                continue
            delta_truth = np.linalg.inv(truth[first]) @ truth[last]
            delta_found = np.linalg.inv(found[first]) @ found[last]
            error = np.linalg.inv(delta_found) @ delta_truth
            angle = np.arccos(np.clip(0.5 * (np.trace(error[:3, :3]) - 1), -1, 1))
            distance = np.linalg.norm(error[:3, 3])
            rows.append((length, 100 * distance / length, np.rad2deg(angle) / length * 100))
    return np.array(rows).T


@pytest.mark.parametrize('lengths', [LENGTHS, (10.0, 25.0)])
def test_the_errors_are_those_of_the_devkit(rng, lengths):
    reference, estimate = drive(rng, 600, step=1.0)
    found = segment_errors(reference, estimate, lengths)
    expected = by_the_devkit(reference.poses, estimate.poses, lengths)
    assert len(found) == expected.shape[1] > 20
    for values, numbers in zip(vars(found).values(), expected, strict=True):
        np.testing.assert_allclose(values, numbers, rtol=0, atol=1e-6)


def test_a_scale_that_is_wrong_by_a_percent_is_an_error_of_a_percent():
    poses = np.eye(4)[None].repeat(900, axis=0)
    poses[:, 0, 3] = np.arange(900)
    scaled = poses.copy()
    scaled[:, 0, 3] *= 1.01
    found = segment_errors(Trajectory(poses), Trajectory(scaled))
    assert set(found.length_m) == set(LENGTHS)
    # a segment ends one pose, here 1 m, beyond its length
    np.testing.assert_allclose(found.translation_percent, 1 + 1 / found.length_m, atol=1e-9)
    np.testing.assert_allclose(found.rotation_deg_per_100m, 0, atol=1e-9)


def test_a_path_that_is_too_short_has_no_segments(rng):
    assert len(segment_errors(*drive(rng, 20))) == 0
