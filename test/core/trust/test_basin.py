import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.landscape import Landscape
from idem_ros.core.trust.basin import FIRST, confidence, gauge, way_between
from idem_ros.core.trust.constraining_surfaces import Holders
from idem_ros.core.trust.contrast import contrasts_along, mean_contrast, sums_at_each
from idem_ros.core.trust.observability import middle_and_arm, unit_motions


@pytest.fixture
def clouds(rng):
    return Cloud(surface(rng, 1500)), Cloud(surface(rng, 1400))


@pytest.fixture
def truth(clouds):
    """Between the clouds' origins."""
    return se3.translation(clouds[1].origin - clouds[0].origin)


def test_the_way_is_how_far_the_motion_between_two_poses_moves_the_surfaces(rng, clouds, truth):
    balls, off = Balls(*clouds, 0.25), motion(rng, 20.0, 0.5)
    middle, arm = middle_and_arm(balls, truth)
    in_units = np.linalg.solve(unit_motions(middle, np.eye(3) / arm), se3.log(off))
    found = way_between(balls, truth, off @ truth)
    assert found == pytest.approx(np.linalg.norm(in_units) / 0.25, rel=1e-9)


def test_sums_are_those_of_the_landscape_where_every_point_is_taken(rng, clouds):
    balls = Balls(*clouds, 0.25)
    transforms = np.array([np.eye(4), motion(rng, 5.0, 0.1), motion(rng, 10.0, 0.3)])
    target, source = clouds
    between = [np.eye(4) for _ in transforms]
    for T, given in zip(between, transforms, strict=True):
        T[:] = given
        T[:3, 3] += given[:3, :3] @ source.origin - target.origin
    q, within = sums_at_each(balls, np.array(between), sample=10**9)
    expected = Landscape(*clouds, 0.25).values(transforms)
    assert q[0] == pytest.approx(expected.q_tot[0])
    assert within[0] == expected.within[0]
    # of points in reach at the first; all of them are here
    assert q[1] == pytest.approx(expected.q_tot[1], rel=0.05)


def test_every_way_out_of_the_truth_leads_up(clouds, truth):
    balls = Balls(*clouds, 0.25)
    q = tuple(side.q for side in balls.agreement(truth, balls.radius))
    some = tuple(np.tile(np.arange(0, len(cloud), 10), 6) for cloud in clouds)
    motion_of = tuple(np.repeat(np.arange(6), len(each) // 6) for each in some)
    rises = contrasts_along(balls, truth, Holders(np.eye(6), some, motion_of), q)
    assert (rises > 0).all()
    assert mean_contrast(balls, truth, np.eye(6), 128) > 0


def test_the_truth_is_credible_and_an_upside_down_pose_is_not(clouds, truth):
    balls = Balls(*clouds, 0.5)
    assert confidence(balls, truth, FIRST) > 0.9
    away = se3.translation([1.8, 0, 0])
    assert confidence(balls, away @ truth, FIRST) < 0.5


def test_the_gauge_is_zero_at_the_minimum_and_grows_towards_the_rim(clouds, truth):
    balls = Balls(*clouds, 0.25)
    ways = [se3.translation([0.25 * way, 0, 0]) for way in (0.0, 0.2, 0.5, 2)]
    guesses = [way @ truth for way in ways]
    at = [gauge(balls, truth, T, way_between(balls, truth, T)) for T in guesses]
    assert at[0] == 0.0
    assert at[1] < at[2] < 1.0 < at[3]
