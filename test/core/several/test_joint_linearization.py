import math

import naive
import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core.geometry import se3
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.several.joint_agreement import agreement_at
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.several.joint_linearization import linearized
from idem_ros.core.several.regions import PERIOD, pulls_of, regions_at, stiffness_along
from idem_ros.core.several.system import system_of
from idem_ros.core.solve.ball_cost import BallCost
from idem_ros.core.workers import Workers

RADIUS, NOISE, STEP = 0.35, 1e-4, 1e-6


@pytest.fixture
def scene(rng):
    """Four clouds, poses of their origins' frames, and the points where these put them."""
    clouds = [Cloud(surface(rng, n, 0.01)) for n in (60, 40, 50, 35)]
    poses = np.array([motion(rng, 5, 0.05) for _ in clouds])
    return clouds, poses


def placed(clouds, poses):
    return [se3.transform_points(T, c.points) for T, c in zip(poses, clouds, strict=True)]


def cost(tangential=False):
    c = (2 * np.pi * np.e) ** 3 / RADIUS**6
    return BallCost(RADIUS**2, c, NOISE, tangential, math.inf, False, False)


def test_q_tot_of_several_clouds_is_that_of_their_union(scene):
    clouds, poses = scene
    found = agreement_at(JointBalls(clouds, RADIUS), poses, RADIUS)
    assert found.q_tot == pytest.approx(naive.joint_q_tot(placed(clouds, poses), RADIUS, RADIUS))


def test_the_sums_between_two_clouds_are_those_of_the_two_alone(scene):
    clouds, poses = scene
    found = agreement_at(JointBalls(clouds, RADIUS), poses, RADIUS)
    a, b = placed(clouds, poses)[1:3]
    assert found.q_between[1, 2] + found.q_between[2, 1] == pytest.approx(
        naive.joint_q_tot([a, b], RADIUS, RADIUS)
    )
    near = np.linalg.norm(a[:, None] - b[None], axis=2) <= RADIUS
    assert found.met[1, 2] == near.any(axis=1).sum()
    assert found.met[2, 1] == near.any(axis=0).sum()


def test_the_gradient_is_that_of_finite_differences_with_the_members_held(scene):
    clouds, poses = scene
    pulls = linearized(JointBalls(clouds, RADIUS), cost(), poses).pulls
    points = placed(clouds, poses)
    balls = naive.members_of_joint_balls(points, RADIUS)

    def q(k, twist):
        moved = list(points)
        moved[k] = se3.transform_points(se3.exp(twist), points[k])
        return naive.held_joint_q(moved, balls, RADIUS, NOISE)

    for k in range(len(clouds)):
        for twist in STEP * np.eye(6):
            slope = (q(k, twist) - q(k, -twist)) / (2 * STEP)
            assert pulls[k, np.argmax(twist)] == pytest.approx(slope, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize('tangential', [False, True])
def test_a_common_motion_changes_nothing(scene, tangential):
    clouds, poses = scene
    found = linearized(JointBalls(clouds, RADIUS), cost(tangential), poses)
    np.testing.assert_allclose(found.pulls.sum(axis=0), 0.0, atol=1e-9 * np.abs(found.pulls).max())
    # each cloud's twist is about its own middle: a common turn moves these, too
    common = np.r_[0.1, -0.2, 0.3, 1.0, 2.0, -1.0]
    twists = np.tile(common, (len(clouds), 1))
    twists[:, 3:] += np.cross(common[:3], poses[:, :3, 3])
    matrix = system_of(found, poses, np.zeros(len(clouds), bool)).matrix
    pushed = matrix @ twists.ravel()
    np.testing.assert_allclose(pushed, 0.0, atol=1e-9 * abs(matrix).max())


def test_any_number_of_threads_gives_the_same_bits(scene, rng):
    clouds = [Cloud(surface(rng, 6000, 0.01)) for _ in range(3)]
    poses = np.array([motion(rng, 2, 0.02) for _ in clouds])
    one, two = (
        linearized(JointBalls(clouds, 0.08, Workers(threads)), cost(True), poses)
        for threads in (1, 3)
    )
    np.testing.assert_array_equal(one.pulls, two.pulls)
    np.testing.assert_array_equal(one.blocks, two.blocks)


def test_lists_too_long_to_keep_give_the_same(scene):
    clouds, poses = scene
    kept = linearized(JointBalls(clouds, RADIUS), cost(True), poses)
    anew = linearized(JointBalls(clouds, RADIUS, most_kept=16), cost(True), poses)
    np.testing.assert_array_equal(kept.pulls, anew.pulls)


def test_balls_left_out_where_many_clouds_overlap_are_stood_for_by_the_others(rng):
    clouds = [Cloud(surface(rng, 500, 0.01)) for _ in range(12)]
    poses = np.array([motion(rng, 2, 0.02) for _ in clouds])
    all_of_them, thinned = (
        linearized(JointBalls(clouds, RADIUS, most_centres=most), cost(True), poses)
        for most in (None, math.inf)
    )
    lists = JointBalls(clouds, RADIUS, most_centres=math.inf).lists(poses)
    assert len(lists.centres.place) < 0.5 * 6000
    assert lists.centres.weight.sum() == pytest.approx(6000, rel=0.1)
    whole = np.linalg.norm(all_of_them.blocks)
    assert np.linalg.norm(thinned.blocks - all_of_them.blocks) < 0.1 * whole
    np.testing.assert_allclose(
        thinned.pulls.sum(axis=0), 0.0, atol=1e-9 * np.abs(thinned.pulls).max()
    )


def test_what_regions_hold_along_a_common_motion_is_nothing_and_along_one_is_the_matrix(scene):
    clouds, poses = scene
    balls, ball_cost = JointBalls(clouds, RADIUS), cost(True)
    regions = regions_at(balls, ball_cost, poses, 0.7)
    twists = np.tile(np.r_[0.1, -0.2, 0.3, 1.0, 2.0, -1.0], (PERIOD**3, len(clouds), 1))
    np.testing.assert_allclose(stiffness_along(regions, twists), 0.0, atol=1e-6)
    twists[:, 1:] = 0.0
    found = linearized(balls, ball_cost, poses)
    np.testing.assert_allclose(pulls_of(regions).sum(axis=0), found.pulls, rtol=1e-9)
    fixed = np.arange(len(clouds)) > 0
    system = system_of(found, poses, fixed)
    about_middle = twists[0, 0].copy()
    about_middle[3:] += np.cross(about_middle[:3], poses[0, :3, 3])
    wanted = about_middle @ (system.matrix @ about_middle)
    assert stiffness_along(regions, twists).sum() == pytest.approx(wanted, rel=1e-9)
