"""Tunnels: a LiDAR's rings hold nothing along them, niches and posts do, however few they are."""

from dataclasses import replace

import numpy as np
import pytest

from idem_ros.core import Cloud, RegistrationConfig, Verdict, register
from idem_ros.core.geometry import se3
from idem_ros.simulation.lidar import Lidar, moving_scan, scan
from idem_ros.simulation.surfaces import Scene, box

WIDE, HIGH = 4.5, 4.0
MOTION = 2.7  # [m]
CONFIG = RegistrationConfig(voxel_size=0.5)


def tunnel(niches):
    """Walls along x with a niche in the left one at each of some places."""
    ends = [-150.0, *niches, 150.0]
    boxes = [
        box((-150, -9, -1), (150, 9, 0)),
        box((-150, -9, HIGH), (150, 9, HIGH + 1)),
        box((-150, -WIDE, -1), (150, -WIDE / 2, HIGH)),
    ]
    for k, (begin, end) in enumerate(zip(ends, ends[1:], strict=False)):
        boxes.append(box((begin + 2.0 * (k > 0), WIDE / 2, -1), (end, WIDE, HIGH)))
        boxes.append(box((begin, WIDE / 2 + 1.2, -1), (end, WIDE + 2, HIGH)))
    return Scene(boxes=boxes)


def scans(scene, rings):
    rng = np.random.default_rng(rings)
    lidar = Lidar(rings=rings, azimuth_steps=900)
    return [scan(scene, se3.translation([x, 0.2, 1.6]), lidar, rng) for x in (0.0, MOTION)]


@pytest.mark.parametrize('guessed', [MOTION, 0.0])
@pytest.mark.parametrize('rings', [16, 32, 64, 128])
def test_along_a_bare_tunnel_a_result_is_as_guessed_and_says_so(rings, guessed):
    result = register(*scans(tunnel([]), rings), se3.translation([guessed, 0.05, 0.05]), CONFIG)
    assert result.assessment.verdict is Verdict.DEGENERATE
    assert result.assessment.free == 'free along x'
    np.testing.assert_allclose(result.T_target_source[:3, 3], [guessed, 0, 0], atol=0.02)


@pytest.mark.parametrize('off', [-MOTION, 0.0, 3.1])
def test_niches_are_found_from_metres_off(off):
    result = register(
        *scans(tunnel([-14.0, -5.0, 7.0, 12.5]), 32), se3.translation([MOTION + off, 0, 0]), CONFIG
    )
    assert result.assessment.verdict is Verdict.ALIGNED
    np.testing.assert_allclose(result.T_target_source[:3, 3], [MOTION, 0, 0], atol=0.02)


@pytest.mark.parametrize('off', [-20.0, -11.0, 9.0, 16.0])
def test_from_afar_niches_that_fall_on_others_are_not_believed(off):
    T_far = se3.translation([MOTION + off, 0, 0])
    result = register(*scans(tunnel([-14.0, -5.0, 7.0, 12.5]), 32), T_far, CONFIG)
    is_right = abs(result.T_target_source[0, 3] - MOTION) < 0.1
    assert is_right or result.assessment.verdict is not Verdict.ALIGNED


def solved_sweep(niches, speed, rings=32):
    """The result of a sweep that is solved from no motion, and its true pose."""
    rng, lidar = np.random.default_rng(32), Lidar(rings=rings, azimuth_steps=900)
    scene, places = tunnel(niches), [(0.0, 0.2, 1.6), (MOTION, 0.2, 1.6)]
    before, begin = (se3.translation(place) for place in places)
    twist = np.array([speed, 0.0, 0.0, 0.0, 0.0, 1.57])
    target = scan(scene, before, lidar, rng)
    points, times = moving_scan(scene, begin, twist, 0.1, lidar, rng)
    truth = se3.inverse(before) @ begin @ se3.exp(times.max() / 2 * twist[[3, 4, 5, 0, 1, 2]])
    guess = truth @ se3.translation([0.2, 0.05, 0.05])
    config = replace(CONFIG, motion='solve', motion_reference='middle')
    return register(target, Cloud(points, times), guess, config), truth


@pytest.mark.parametrize(('speed', 'rings'), [(10.0, 32), (15.0, 64)])
def test_of_a_sweep_through_niches_pose_and_speed_are_found_from_no_motion(speed, rings):
    result, truth = solved_sweep([-14.0, -5.0, 7.0, 12.5], speed, rings)
    assert result.assessment.verdict is Verdict.ALIGNED
    np.testing.assert_allclose(result.T_target_source[:3, 3], truth[:3, 3], atol=0.03)
    assert result.twist[0] == pytest.approx(speed, abs=1.5)


def test_where_nothing_tells_the_speed_the_covariance_knows_of_the_bow_that_is_missed():
    result, truth = solved_sweep([-14.0], speed=20.0, rings=128)
    assert result.assessment.free == 'free along x'
    aside = (result.T_target_source - truth)[1, 3]
    assert abs(aside) > 0.01
    assert abs(aside) < np.sqrt(result.assessment.covariance[1, 1])


def test_a_pose_at_which_only_the_rings_coincide_is_audited_as_free():
    audit = RegistrationConfig(voxel_size=0.5, mode='audit')
    said = register(*scans(tunnel([]), 64), np.eye(4), audit).assessment
    assert said.verdict is not Verdict.ALIGNED
    assert said.free == 'free along x'
