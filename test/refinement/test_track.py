import numpy as np
import pytest
from clouds import motion

from idem_ros.core import undistort
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.refinement.track import Track, motion_by, twist_of

TWIST = np.array([12.0, -1.0, 0.5, 0.2, -0.4, 1.8])


@pytest.fixture
def track(rng):
    times = np.array([-0.05, 0.0, 0.02, 0.11])
    poses = [motion(rng, 40.0, 5.0)]
    for _ in times[1:]:
        poses.append(poses[-1] @ motion(rng, 0.5, 0.2))
    return Track(times, np.array(poses))


def test_each_point_is_moved_by_the_motion_from_its_time_to_the_reference(track, rng):
    points, times = rng.normal(size=(300, 3)) * 30.0, rng.uniform(-0.06, 0.12, 300)
    undone = track.undone(points, times, 0.01)
    T_reference = inverse(track.pose_at(0.01))
    for point, time, found in zip(points, times, undone, strict=True):
        expected = transform_points(T_reference @ track.pose_at(time), point)
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_points_may_be_given_from_an_origin(track, rng):
    points, times = rng.normal(size=(300, 3)) * 30.0, rng.uniform(-0.05, 0.11, 300)
    origin = np.array([100.0, -20.0, 3.0])
    from_origin = track.undone(points - origin, times, 0.0, origin)
    np.testing.assert_allclose(from_origin + origin, track.undone(points, times, 0.0), atol=1e-9)


def test_a_constant_twist_is_undone_as_the_core_does(rng):
    points, times = rng.normal(size=(300, 3)) * 30.0, rng.uniform(0.0, 0.1, 300)
    undone = Track.of_twist(TWIST).undone(points, times, 0.05)
    np.testing.assert_allclose(undone, undistort(points, times, TWIST, 0.05), atol=2e-5)


def test_it_goes_through_its_poses_and_on_as_it_was(track):
    np.testing.assert_allclose(track.poses_at(track.times), track.poses, atol=1e-12)
    before, after = track.step(-0.09, -0.07), track.step(-0.05, -0.03)
    np.testing.assert_allclose(before, after, atol=1e-12)


def test_the_mean_twist_makes_the_whole_step(track):
    twist = track.mean_twist(-0.05, 0.11)
    np.testing.assert_allclose(motion_by(twist, 0.16), track.step(-0.05, 0.11), atol=1e-12)
    np.testing.assert_allclose(twist_of(motion_by(TWIST, 0.1), 0.1), TWIST, atol=1e-12)


def test_measured_turns_replace_those_of_the_poses_and_leave_the_positions(track):
    times = np.linspace(-0.04, 0.1, 5)
    turns = np.array(
        [se3.exp([0.0, 0.0, 3.0 * t, 0.0, 0.0, 0.0])[:3, :3] for t in times - times[0]]
    )
    turned = track.turned(times, turns)
    before = track.poses_at(times)
    np.testing.assert_allclose(turned.poses[:, :3, 3], before[:, :3, 3])
    np.testing.assert_allclose(turned.poses[0], before[0])
    np.testing.assert_allclose(turned.mean_twist(-0.04, 0.1)[3:], [0.0, 0.0, 3.0], atol=1e-9)
