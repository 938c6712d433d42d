from typing import NamedTuple

import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.calibration.rig_motion import (
    at_one_time,
    independent,
    is_still,
    motion_at_time,
    twist_at,
)
from idem_ros.calibration.synchronized_scans import Measured
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3

TWIST = np.array([0.4, -0.2, 0.1, 0.1, 0.2, -0.3])
ORDER = [3, 4, 5, 0, 1, 2]
SPREAD = 0.03
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
    found = motion_at_time(0.05, SPREAD, first, [(second, later)], CONFIG).twist
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
    bend = motion_at_time(when, SPREAD, first[0], others, CONFIG)
    found = bend.twist
    off = np.abs(found - (1 + change * when) * TWIST).max()
    straight = motion_at_time(when, SPREAD, first[0], others[1:], CONFIG)
    one = straight.twist
    assert off < 0.03 < np.abs(one - (1 + change * when) * TWIST).max()
    # how much it changes within the sweep is not known of one twist
    assert np.trace(bend.covariance) > 0.9 * (change * SPREAD) ** 2 * TWIST @ TWIST
    assert np.trace(straight.covariance) < np.trace(bend.covariance)


def test_a_rig_that_stands_is_still(rng):
    clouds = [Measured(surface(rng, 2000)) for _ in range(2)]
    assert is_still(0.02 * motion_at_time(0.0, 0.0, clouds[0], [(clouds[1], 1.0)], CONFIG).twist)


class Step(NamedTuple):
    """What is looked at of a registration."""

    T_target_source: np.ndarray
    overlap: float


def test_instants_count_by_how_much_they_have_in_common():
    far, near = (Step(se3.translation(np.array([x, 0, 0])), 0.9) for x in (2.0, 0.1))
    apart = Step(far.T_target_source, 0.0)
    assert independent([], 0.5) == 1
    assert independent([near, near], 0.5) == 1
    assert independent([None, apart], 0.5) == 3
    assert 1.2 < independent([far], 0.5) < 1.8
    assert independent([far, far], 0.5) < independent([far, None], 0.5) < 3
