import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    InvalidConfig,
    RegistrationConfig,
    Status,
    register,
)
from idem_ros.core import undistort as undone
from idem_ros.core.geometry import se3

TWIST = np.array([1.5, -0.5, 0.2, 0.3, -0.2, 1.5])
BEGIN, END = -0.02, 0.08


def swept(rng, still, twist=TWIST):
    """Points as a sensor sees them that moves while it turns, in its frame at each time."""
    times = BEGIN + (END - BEGIN) * (np.arctan2(still[:, 1], still[:, 0]) / (2 * np.pi) + 0.5)
    seen = [
        se3.transform_points(se3.exp(-t * twist[[3, 4, 5, 0, 1, 2]]), p)
        for p, t in zip(still, times, strict=True)
    ]
    mixed = rng.permutation(len(still))
    return np.array(seen)[mixed], times[mixed]


@pytest.fixture
def sweep(rng):
    """A target, a source measured in motion, its times, and the pose at its stamp."""
    truth = motion(rng, 20, 0.4)
    still = se3.transform_points(se3.inverse(truth), surface(rng, 2500, 0.003))
    return surface(rng, 3000, 0.003), *swept(rng, still), truth


@pytest.mark.parametrize('motion_', ['guess', 'last'])
def test_a_motion_that_is_known_is_undone_before_the_points_are_registered(sweep, rng, motion_):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion=motion_)
    start = truth @ motion(rng, 3, 0.05)
    result = register(target, Cloud(points, times), start, config, twist=TWIST)
    degrees, distance = error_of(result.T_target_source, truth)
    assert degrees < 0.15
    assert distance < 0.003
    assert np.allclose(result.twist, TWIST, atol=1e-12)
    still = register(target, points, start, RegistrationConfig(voxel_size=0.08))
    assert error_of(still.T_target_source, truth)[1] > 0.02
    assert still.twist is None


def test_the_result_tells_how_far_the_points_moved(sweep):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion='guess')
    result = register(target, Cloud(points, times), truth, config, twist=TWIST)
    moves = np.linalg.norm(undone(points, times, TWIST) - points, axis=1)
    assert result.moved == pytest.approx(np.median(moves), rel=0.1)


@pytest.mark.parametrize(
    ('reference', 'time'),
    [('stamp', 0.0), ('begin', BEGIN), ('middle', (BEGIN + END) / 2), ('end', END)],
)
def test_the_pose_is_that_at_the_reference(sweep, reference, time):
    target, points, times, truth = sweep
    T_there = truth @ se3.exp(time * TWIST[[3, 4, 5, 0, 1, 2]])
    config = RegistrationConfig(voxel_size=0.08, motion='guess', motion_reference=reference)
    result = register(target, Cloud(points, times), T_there, config, twist=TWIST)
    degrees, distance = error_of(result.T_target_source, T_there)
    assert degrees < 0.15
    assert distance < 0.003


@pytest.mark.parametrize(
    ('times', 'flaw'),
    [
        (None, 'the source has no point times'),
        (np.full(2500, 0.05), 'all points have the time 0.05 s'),
        (np.linspace(0.0, 3.0, 2500), 'the times span 3 s; a sweep takes 1 s at most'),
        (np.linspace(1e9, 1e9 + 0.1, 2500), r'from the stamp: times of another sweep'),
    ],
)
def test_times_that_tell_of_no_sweep_are_said_and_taken_as_none(sweep, times, flaw):
    target, points, _, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion='guess')
    result = register(target, Cloud(points, times), truth, config, twist=TWIST)
    assert flaw in result.motion_flaw
    assert result.twist is None
    as_measured = register(target, points, truth, RegistrationConfig(voxel_size=0.08))
    assert np.array_equal(result.T_target_source, as_measured.T_target_source)


def test_a_motion_that_nobody_knows_is_said(sweep):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion='last')
    result = register(target, Cloud(points, times), truth, config)
    assert result.motion_flaw == 'no twist of the sweep is known'


def test_a_twist_that_would_not_be_undone_is_refused(sweep):
    target, points, times, truth = sweep
    with pytest.raises(InvalidConfig, match='a twist is given and motion is none'):
        register(target, Cloud(points, times), truth, twist=TWIST)


def test_dropped_points_lose_their_times_with_them(rng):
    points, times = rng.normal(size=(20, 3)), np.linspace(0.0, 0.1, 20)
    points[4], times[4] = np.nan, np.nan
    cloud = Cloud(points, times)
    assert np.array_equal(cloud.times, np.delete(times, 4))
    with pytest.raises(ValueError, match='read-only'):
        cloud.times[0] = 1.0


def test_a_point_without_its_time_is_refused(rng):
    times = np.linspace(0.0, 0.1, 20)
    times[7] = np.nan
    with pytest.raises(InvalidCloud, match='1 of 20 points have no finite time'):
        Cloud(rng.normal(size=(20, 3)), times)
    with pytest.raises(InvalidCloud, match=r'times have the shape \(20,\); it must be \(19,\)'):
        Cloud(rng.normal(size=(19, 3)), np.zeros(20))


def test_voxels_carry_the_mean_time_of_their_points(rng):
    points, times = rng.uniform(0.0, 2.0, (500, 3)), rng.uniform(0.0, 0.1, 500)
    cloud = Cloud(points, times)
    reduced = cloud.reduced(0.7)
    low = cloud.points.min(axis=0)
    voxel = np.floor((cloud.points - low) / 0.7).astype(int)
    for mean, time in zip(reduced.points, reduced.times, strict=True):
        inside = (voxel == np.floor((mean - low) / 0.7)).all(axis=1)
        assert time == pytest.approx(times[inside].mean(), rel=1e-12)


def test_the_twist_is_found_with_the_pose_from_no_motion_at_all(sweep, rng):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion='solve')
    start = truth @ motion(rng, 3, 0.05)
    result = register(target, Cloud(points, times), start, config)
    degrees, distance = error_of(result.T_target_source, truth)
    assert degrees < 0.5
    assert distance < 0.01
    assert np.abs(result.twist - TWIST).max() < 0.15
    error = result.twist - TWIST
    spread = result.assessment.twist_covariance
    assert error @ np.linalg.solve(spread, error) < 22.5  # 0.1 % of six degrees of freedom
    assert result.is_usable


@pytest.mark.parametrize(
    ('reference', 'time'), [('stamp', 0.0), ('middle', (BEGIN + END) / 2), ('end', END)]
)
def test_the_solved_pose_is_that_at_the_reference(sweep, reference, time):
    target, points, times, truth = sweep
    T_there = truth @ se3.exp(time * TWIST[[3, 4, 5, 0, 1, 2]])
    config = RegistrationConfig(voxel_size=0.08, motion='solve', motion_reference=reference)
    result = register(target, Cloud(points, times), T_there, config, twist=0.9 * TWIST)
    degrees, distance = error_of(result.T_target_source, T_there)
    assert degrees < 0.5
    assert distance < 0.01


def test_the_middle_of_a_sweep_is_known_better_than_its_ends(sweep):
    target, points, times, truth = sweep
    spread = {}
    for reference in ('begin', 'middle', 'end'):
        config = RegistrationConfig(voxel_size=0.08, motion='solve', motion_reference=reference)
        result = register(target, Cloud(points, times), truth, config, twist=TWIST)
        spread[reference] = np.trace(result.assessment.covariance)
    assert spread['middle'] < min(spread['begin'], spread['end'])


def test_a_source_that_stood_still_is_found_to(sweep, rng):
    target, _, times, truth = sweep
    still = se3.transform_points(se3.inverse(truth), surface(rng, len(times), 0.003))
    points, times = swept(rng, still, np.zeros(6))
    config = RegistrationConfig(voxel_size=0.08, motion='solve')
    result = register(target, Cloud(points, times), truth, config)
    assert np.abs(result.twist).max() < 0.15
    assert error_of(result.T_target_source, truth)[1] < 0.01


def test_the_result_is_the_same_for_any_number_of_threads(sweep):
    target, points, times, truth = sweep
    alone, shared = (
        register(
            target,
            Cloud(points, times),
            truth,
            RegistrationConfig(voxel_size=0.08, motion='solve', threads=threads),
        )
        for threads in (1, 3)
    )
    assert np.array_equal(alone.T_target_source, shared.T_target_source)
    assert np.array_equal(alone.twist, shared.twist)
    assert np.array_equal(alone.assessment.covariance, shared.assessment.covariance)


@pytest.mark.parametrize('motion_', ['none', 'guess', 'last', 'solve'])
def test_an_audit_moves_neither_the_pose_nor_the_twist(sweep, motion_):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, mode='audit', motion=motion_)
    twist = None if motion_ == 'none' else TWIST
    result = register(target, Cloud(points, times), truth, config, twist=twist)
    assert result.T_target_source == pytest.approx(truth, abs=1e-12)
    assert twist is None or np.allclose(result.twist, TWIST, atol=1e-12)


def test_a_budget_that_is_spent_ends_a_solve_of_motion_too(sweep):
    target, points, times, truth = sweep
    config = RegistrationConfig(voxel_size=0.08, motion='solve', budget_ms=1e-3)
    assert register(target, Cloud(points, times), truth, config).status is Status.LATE


def test_a_twist_whose_error_is_known_is_weighed_against_the_clouds(sweep, rng):
    target, points, times, truth = sweep
    start, given = truth @ motion(rng, 2, 0.03), TWIST + rng.normal(0.0, 0.01, 6)
    errors, spreads = [], []
    for sigma in ((0.0, 0.0), (0.01, np.degrees(0.01))):
        config = RegistrationConfig(voxel_size=0.08, motion='solve', twist_sigma=sigma)
        result = register(target, Cloud(points, times), start, config, twist=given)
        errors.append(np.linalg.norm(result.twist - TWIST))
        spreads.append(np.trace(result.assessment.twist_covariance))
        assert error_of(result.T_target_source, truth)[0] < 0.5
    assert errors[1] < errors[0]
    assert spreads[1] < spreads[0]


def test_weights_without_a_covariance_to_weigh_by_are_refused():
    with pytest.raises(InvalidConfig, match='twist_sigma is given and assessment none'):
        RegistrationConfig(motion='solve', twist_sigma=(0.1, 1.0), assessment='none')
