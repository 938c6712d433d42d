import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.calibration.rig_motion import at_one_time, is_still, places, twist_at, twist_at_time
from idem_ros.calibration.sighting import Measured
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3

TWIST = np.array([0.4, -0.2, 0.1, 0.1, 0.2, -0.3])
ORDER = [3, 4, 5, 0, 1, 2]
CONFIG = RegistrationConfig(voxel_size=None)


def swept(rng, pose, start, points, change=0.0):
    """What a sensor at a pose on a moving rig measures of a body, from a time on, in 0.1 s.

    change: of the twist, a second, in shares of it.
    """
    times = start + 0.1 * np.arange(len(points)) / len(points)
    seen = np.empty_like(points)
    for k, (time, point) in enumerate(zip(times, points, strict=True)):
        there = se3.exp((time + change * time**2 / 2) * TWIST[ORDER]) @ pose
        seen[k] = se3.transform_points(se3.inverse(there), point[None])[0]
    return seen, times


def test_points_of_a_moving_rig_are_put_to_one_time(rng):
    pose, body = motion(rng, 50.0, 0.5), surface(rng, 300)
    seen, times = swept(rng, pose, 0.03, body)
    cloud = at_one_time(Measured(seen, times), pose, TWIST)
    there = se3.transform_points(pose, cloud.points + cloud.origin)
    np.testing.assert_allclose(there, body, atol=1e-9)


def test_a_twist_of_the_rig_is_that_of_its_sensor_elsewhere(rng):
    pose = motion(rng, 50.0, 0.5)
    own = twist_at(pose, TWIST)
    moved = se3.exp(TWIST[ORDER]) @ pose
    np.testing.assert_allclose(pose @ se3.exp(own[ORDER]), moved, atol=1e-12)


@pytest.mark.parametrize('later', [0.2, -0.2])
def test_two_sweeps_of_the_reference_tell_how_the_rig_moves(rng, later):
    first, second = (
        Measured(seen, times - start)
        for start in (0.0, later)
        for seen, times in [swept(rng, np.eye(4), start, surface(rng, 2500))]
    )
    # the twist is constant, so that the same one moves the second from its own stamp on
    found = twist_at_time(0.05, first, [(second, later)], CONFIG)
    np.testing.assert_allclose(found, TWIST, atol=0.03)
    assert not is_still(found)


def test_in_a_bend_each_sweep_has_a_twist_of_its_own(rng):
    change, stamps = 2.0, (0.0, -0.2, 0.2)
    first, *others = (
        (Measured(seen, times - stamp), stamp)
        for stamp in stamps
        for seen, times in [swept(rng, np.eye(4), stamp, surface(rng, 2500), change)]
    )
    when = 0.05
    found = twist_at_time(when, first[0], others, CONFIG)
    off = np.abs(found - (1 + change * when) * TWIST).max()
    one = twist_at_time(when, first[0], others[1:], CONFIG)
    assert off < 0.03 < np.abs(one - (1 + change * when) * TWIST).max()


def test_a_rig_that_stands_is_still(rng):
    clouds = [Measured(surface(rng, 2000)) for _ in range(2)]
    assert is_still(0.02 * twist_at_time(0.0, clouds[0], [(clouds[1], 1.0)], CONFIG))


def test_places_are_counted_by_what_moved_and_what_is_unknown():
    far, near = se3.translation(np.array([2.0, 0, 0])), se3.translation(np.array([0.1, 0, 0]))
    assert places([], 0.5) == 1
    assert places([far, near, None, near], 0.5) == 3
