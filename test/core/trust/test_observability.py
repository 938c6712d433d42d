import naive
import numpy as np
import pytest
from clouds import surface
from costs import joint_entropy

from benchmarks.bare_scenes import BARE_SCENES, BOX_AT, bare_case
from benchmarks.case import displaced
from idem_ros.core import Cloud, RegistrationConfig, Status, register
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.trust.constraining_surfaces import holders_of
from idem_ros.core.trust.observability import Observability, observability_of, unit_motions
from idem_ros.core.trust.surfaces import SURFACE, _flatness_and_normal

TRANSLATION_FIRST = [3, 4, 5, 0, 1, 2]
ALL = 10**9


def refined(case, **parameters):
    guess = displaced(case.truth, case.centroid, 1.0, 0.05, np.random.default_rng(0))
    config = RegistrationConfig(voxel_size=case.voxel_size, **parameters)
    return guess, register(case.target, case.source, guess, config)


def left_twist(T, truth):
    """The motion (v, omega) from the truth to T, both small, in the target frame."""
    off = T @ se3.inverse(truth)
    return np.r_[off[:3, 3], off[2, 1], off[0, 2], off[1, 0]]


@pytest.mark.parametrize('voxel_size', [None, 0.15])
@pytest.mark.parametrize('name', BARE_SCENES)
def test_the_motions_that_a_scene_leaves_free_are_found(name, voxel_size):
    _, free = BARE_SCENES[name]
    _, result = refined(bare_case(name, 0, voxel_size))
    assert len(result.free_motions) == len(free)
    for motion in np.array(free).reshape(-1, 6)[:, TRANSLATION_FIRST]:
        along, *_ = np.linalg.lstsq(result.free_motions.T, motion, rcond=None)
        np.testing.assert_allclose(result.free_motions.T @ along, motion, atol=0.05)
    assert (result.status is Status.DEGENERATE) == bool(free)


def test_free_motions_stay_as_guessed_and_the_others_are_refined():
    case = bare_case('corridor', 1, 0.15)
    guess, kept = refined(case)
    before, after = (left_twist(T, case.truth) for T in (guess, kept.T_target_source))
    assert after[0] == pytest.approx(before[0], abs=0.006)  # along x
    assert np.abs(after[1:3]).max() < 2e-3 < 0.02 < np.abs(before[1:3]).max()
    assert np.abs(after[3:]).max() < 1e-3
    _, solved = refined(case, free_motions='solve')
    assert len(solved.free_motions) == 1
    assert abs(left_twist(solved.T_target_source, case.truth)[0] - before[0]) > 0.012


def test_a_pole_is_neither_slid_along_its_axis_nor_turned_about_it():
    case = bare_case('pole', 0, 0.15)
    guess, kept = refined(case)
    before, after = (left_twist(T, case.truth) for T in (guess, kept.T_target_source))
    assert after[[2, 5]] == pytest.approx(before[[2, 5]], abs=0.01)


def test_a_scene_that_holds_every_motion_leaves_none(rng):
    points = surface(rng, 4000)
    result = register(points, surface(rng, 4000))
    assert result.status is Status.CONVERGED
    assert result.free_motions.shape == (0, 6)


def test_strengths_are_those_of_the_equations(rng):
    target, source = Cloud(surface(rng, 900)), Cloud(surface(rng, 700))
    T, radius = se3.exp(0.01 * rng.normal(size=6)), 0.3
    found = observability_of(joint_entropy(target, source, radius), T)
    moved = se3.transform_points(T, source.points)
    strength, balls = naive.hold(target.points, moved, radius, found.units)
    assert len(found.along) == balls > 500
    np.testing.assert_allclose(found.strength, strength, rtol=1e-6)


def test_the_roll_of_a_long_corridor_is_held(rng):
    half = np.array([25.0, 1.0, 1.25])
    clouds = []
    for _ in range(2):
        points = rng.uniform(-1, 1, (12_000, 3))
        across, side = 1 + rng.integers(0, 2, 12_000), rng.choice([-1.0, 1.0], 12_000)
        points[np.arange(12_000), across] = side
        clouds.append(points * half + 0.005 * rng.normal(size=points.shape))
    guess = se3.exp(np.array([np.radians(3.0), 0, 0, 0.1, 0.05, 0.05]))
    result = register(*clouds, guess, RegistrationConfig(voxel_size=0.1))
    assert result.assessment.free == 'free along x'
    assert np.degrees(np.abs(left_twist(result.T_target_source, np.eye(4))[3])) < 0.1
    sigma = np.sqrt(np.diag(result.assessment.covariance))
    assert sigma[0] > 5.0  # [m]
    assert sigma[1:3].max() < 0.1


def held_by(holders, motion):
    """The centres of the target, and of the source, that determine a motion."""
    return [
        some[which == motion] for some, which in zip(holders.centres, holders.motion, strict=True)
    ]


def test_a_motion_is_held_by_the_surfaces_across_it():
    case = bare_case('box in corridor', 0)
    clouds = Cloud(case.target), Cloud(case.source)
    cost = joint_entropy(*clouds, 0.4)
    found = observability_of(cost, between_origins(*clouds, case.truth))
    forth = int(np.argmax(np.abs(found.motions[3])))  # along x: only the box is across it
    holders = holders_of(found, ALL)
    of_target, of_source = held_by(holders, forth)
    assert np.abs(holders.motions[3, forth]) == pytest.approx(1.0, abs=0.05)
    assert 0 < len(of_target) + len(of_source) < 0.1 * len(found.along)
    near = (
        np.abs(cost.balls.target.grid.points[of_target, 0] + clouds[0].origin[0] - BOX_AT[0]) < 0.8
    )
    assert near.mean() > 0.7


def test_unit_motions_move_points_at_the_arm_by_one(rng):
    pivot, arm = rng.normal(size=3), 5.0
    at = pivot + [0, arm, 0]
    for turn in (0, 2):
        twist = unit_motions(pivot, np.eye(3) / arm)[:, turn]
        moved = np.cross(twist[:3], at) + twist[3:]
        assert np.linalg.norm(moved) == pytest.approx(1.0)


def test_motions_that_turn_have_no_way_and_the_others_move_all_along_theirs():
    case = bare_case('box in corridor', 0)
    clouds = Cloud(case.target), Cloud(case.source)
    found = observability_of(joint_entropy(*clouds, 0.4), between_origins(*clouds, case.truth))
    ways = dict(found.ways(np.ones(6, bool)))
    assert len(ways) == 3
    for k, way in ways.items():
        assert np.linalg.norm(way) == pytest.approx(1.0)
        assert found.most_along(way) == k
    held = found.observable & (np.arange(6) != min(ways))
    assert dict(found.ways(held)).keys() == ways.keys() & set(np.flatnonzero(held))
    assert not list(found.ways(np.zeros(6, bool)))


def test_the_normal_is_the_axis_of_least_spread_and_no_other(rng):
    for spread in ((4.0, 3.0, 0.1), (9.0, 1.5, 0.001)):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        s = axes @ np.diag(spread) @ axes.T
        flatness, normal = _flatness_and_normal(
            (s[0, 0], s[0, 1], s[0, 2], s[1, 1], s[1, 2], s[2, 2]), SURFACE
        )
        assert 0.0 <= flatness < 0.25
        assert abs(np.dot(normal, axes[:, 2])) == pytest.approx(1.0, abs=1e-9)
    for without in ((4.0, 0.0, 0.0, 0.1, 0.0, 0.001), 6 * (0.0,)):  # a line has no normal
        assert _flatness_and_normal(without, SURFACE)[0] < 0


def strewn(rng, flat, count=3000):
    """Points of a line along x (flat = [1, 2]) or of the plane z = 0 (flat = [2]), exactly."""
    points = 10.0 * rng.random((count, 3))
    points[:, flat] = 0.0
    return points


@pytest.mark.parametrize(('flat', 'free'), [([2], 3), ([1, 2], 2)])
def test_exact_planes_and_lines_hold_nothing_along_themselves(rng, flat, free):
    guess = se3.translation([0.01, 0.02, 0.005])
    result = register(strewn(rng, flat), strewn(rng, flat), guess)
    assert result.status is Status.DEGENERATE
    assert len(result.free_motions) == free
    assert 'one plane' in result.assessment.reason
    np.testing.assert_allclose(result.T_target_source[flat, 3], 0.0, atol=1e-6)


def test_a_few_balls_alone_do_not_tell_what_determines_a_motion():
    along = np.r_[9.0, 7.0, np.ones(50), np.zeros(50)][:, None] * np.ones(6)
    centres = np.arange(60), np.arange(42)
    seen = Observability(
        *(np.ones(6), np.zeros(6), np.ones(6), 0.0, np.eye(6), np.eye(6), 1.0, along, centres),
        np.ones(6, bool),
    )
    holders = holders_of(seen, ALL)
    of_target, of_source = held_by(holders, 2)
    assert holders.motions.tolist() == np.eye(6).tolist()
    assert (of_target.tolist(), of_source.tolist()) == (list(range(52)), [])
