from array import array

import numpy as np
import pytest
from clouds import error_of
from drives import drive, stamps_of

from idem_ros.core import InvalidConfig, RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.smoothing.joining import Found, joined
from idem_ros.smoothing.keyframes import KeyframeClouds, Scans
from idem_ros.smoothing.smoother import Smoother, between_keyframes

REGISTRATION = RegistrationConfig(voxel_size=0.05)


def in_this_process(tasks):
    yield from reversed([(k, joined(task)) for k, task in enumerate(tasks)])


def smoothed(folder, clouds, odometry, run=in_this_process, pairs=(), **config):
    store = KeyframeClouds(folder)
    for k, points in enumerate(clouds):
        store.write(k, points)
    config = SmoothingConfig(keyframe_distance=0.3, **config)
    return Smoother(store, odometry, 0.8, config, REGISTRATION, run).smooth(pairs)


def errors(poses, truth):
    return np.array([error_of(*each)[1] for each in zip(poses, truth, strict=True)])


def test_a_drift_is_taken_out_and_loops_are_found(rng, tmp_path):
    clouds, truth, odometry = drive(rng)
    found = smoothed(tmp_path, clouds, odometry)
    assert errors(found.poses, truth).max() < 0.5 * errors(odometry, truth).max()
    loops = [each for each in found.relations if each.is_loop]
    assert sum(each.counts for each in loops) >= 4
    assert found.part.max() == 0
    assert found.failures == []
    np.testing.assert_array_equal(found.poses[0], odometry[0])


def test_a_cloud_that_meets_nothing_stays_where_the_trajectory_has_it(rng, tmp_path):
    clouds, truth, odometry = drive(rng, 6)
    clouds[3] = clouds[3] + (5.0, 0.0, 0.0)
    found = smoothed(tmp_path, clouds, odometry)
    alone = np.bincount(found.part)[found.part] == 1
    np.testing.assert_array_equal(np.flatnonzero(alone), [3])
    step = se3.inverse(found.poses[2]) @ found.poses[3]
    given = se3.inverse(odometry[2]) @ odometry[3]
    np.testing.assert_allclose(step, given, atol=0.05)
    assert errors(found.poses, truth).max() < 0.1


def test_two_parts_are_held_together_by_the_trajectory_alone(rng, tmp_path):
    clouds, truth, odometry = drive(rng, 6, off=(0.1, 0.002))
    for k in (3, 4, 5):  # of another body, far away
        seen = se3.transform_points(truth[k], clouds[k]) + (5.0, 0.0, 0.0)
        clouds[k] = se3.transform_points(se3.inverse(truth[k]), seen)
    found = smoothed(tmp_path, clouds, odometry)
    np.testing.assert_array_equal(found.part, [0, 0, 0, 1, 1, 1])


def test_a_window_that_cannot_be_done_is_named_and_the_others_go_on(rng, tmp_path):
    clouds, truth, odometry = drive(rng, 8)

    def first_fails(tasks):
        for k, task in enumerate(tasks):
            yield k, Found(task.path, reason='killed') if k == 0 else joined(task)

    found = smoothed(tmp_path, clouds, odometry, first_fails, window=4)
    assert found.failures[0] == 'keyframes 0 to 3: killed'
    assert found.part[-1] == found.part[-4]
    assert errors(found.poses, truth).max() < 0.2


def test_pairs_that_are_given_are_tried_however_far_the_trajectory_has_them(rng, tmp_path):
    clouds, _, odometry = drive(rng, 6)
    found = smoothed(tmp_path, clouds, odometry, pairs=[(0, 5)])
    assert [(each.i, each.j) for each in found.relations if each.is_loop] == [(0, 5)]


def test_scans_between_keyframes_follow_the_trajectory_from_either(rng):
    _, truth, odometry = drive(rng, 5)
    keyframes = array('q', [0, 4])
    scans = Scans(keyframes=keyframes)
    for stamp, pose in zip(stamps_of(5), odometry, strict=True):
        scans.add(stamp, pose)
    moved = se3.translation((0.0, 0.0, 1.0))
    poses = np.array([odometry[0], moved @ odometry[4]])
    found = between_keyframes(scans, poses)
    np.testing.assert_allclose(found[[0, 4]], poses)
    heights = (found - odometry)[:, 2, 3]
    np.testing.assert_allclose(heights, [0.0, 0.25, 0.5, 0.75, 1.0], atol=1e-9)


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'window': 1}, 'window is 1; it must be a whole number from 2 to 50'),
        ({'window': 2.5}, 'whole number'),
        ({'keyframe_distance': 0.0}, 'keyframe_distance is 0.0'),
        ({'keyframe_turn': 300.0}, 'from 1 to 180'),
        ({'reach': -1.0}, 'reach is -1.0'),
        ({'odometry_sigma': (0.1,)}, 'metres and degrees'),
        ({'odometry_sigma': (0.1, 0.0)}, 'odometry_sigma is 0.0'),
    ],
)
def test_values_out_of_range_are_refused(given, words):
    with pytest.raises(InvalidConfig, match=words):
        SmoothingConfig(**given)
