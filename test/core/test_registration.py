import dataclasses

import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    InvalidTransform,
    RegistrationConfig,
    Status,
    q_tot,
    register,
)
from idem_ros.core.geometry import se3
from idem_ros.core.metric.q_tot import search_radius


@pytest.fixture
def pair(rng):
    """Two independent samplings of one surface, the second moved; and the truth."""
    truth = motion(rng, 30, 0.5)
    source = se3.transform_points(se3.inverse(truth), surface(rng, 2500, 0.003))
    return surface(rng, 3000, 0.003), source, truth


@pytest.mark.parametrize('voxel_size', [None, 0.08])
@pytest.mark.parametrize('seed', range(5))
def test_recovers_a_known_transform_from_a_perturbed_start(pair, seed, voxel_size):
    target, source, truth = pair
    start = truth @ motion(np.random.default_rng(seed), 4, 0.08)
    result = register(target, source, start, RegistrationConfig(voxel_size=voxel_size))
    degrees, distance = error_of(result.T_target_source, truth)
    assert result.converged
    assert degrees < 0.15
    assert distance < 0.003  # one standard deviation of the points


@pytest.mark.parametrize('voxel_size', [None, 0.08])
def test_both_directions_give_the_same_transform(pair, voxel_size, rng):
    target, source, truth = pair
    start, config = truth @ motion(rng, 2, 0.04), RegistrationConfig(voxel_size=voxel_size)
    forth = register(target, source, start, config)
    back = register(source, target, se3.inverse(start), config)
    degrees, distance = error_of(se3.inverse(back.T_target_source), forth.T_target_source)
    assert degrees < 2e-3
    assert distance < 2e-5
    assert back.q_tot == pytest.approx(forth.q_tot, rel=1e-3)


def test_an_identical_cloud_is_aligned_exactly(rng):
    cloud, truth = surface(rng, 1500), motion(rng, 3, 0.05)
    source = se3.transform_points(se3.inverse(truth), cloud)
    result = register(cloud, source)
    degrees, distance = error_of(result.T_target_source, truth)
    assert result.converged
    assert degrees < 1e-3
    assert distance < 1e-5
    assert result.q_tot < 1e-2
    assert result.overlap == 1.0


def test_started_at_the_truth_it_stays(pair):
    target, source, truth = pair
    degrees, distance = error_of(register(target, source, truth).T_target_source, truth)
    assert degrees < 0.15
    assert distance < 0.003


def test_a_shift_to_map_coordinates_changes_nothing(pair, rng):
    target, source, truth = pair
    far = np.eye(4)
    far[:3, 3] = (1e6, -3e5, 200)
    start = truth @ motion(rng, 2, 0.04)
    near = register(target, source, start)
    result = register(target + far[:3, 3], source, far @ start)
    assert result.converged
    degrees, distance = error_of(se3.inverse(far) @ result.T_target_source, near.T_target_source)
    assert degrees < 1e-3
    assert distance < 1e-5


def test_the_reported_numbers_are_those_of_the_metric(pair):
    target, source, truth = pair
    result = register(target, source, truth, RegistrationConfig(a=1.2))
    assert 0.95 < result.radius / search_radius(target, source, 1.2) < 2.1  # wider for the noise
    assert result.q_tot == pytest.approx(
        q_tot(target, source, result.T_target_source, radius=result.radius), rel=1e-9
    )
    assert 0.9 < result.overlap <= 1.0
    assert result.q_mean == pytest.approx(result.q_tot / (result.overlap * 5500))


def test_partial_overlap_is_reported_as_such(rng):
    cloud, other = surface(rng, 4000), surface(rng, 4000)
    target, source = cloud[cloud[:, 0] > -0.3], other[other[:, 0] < 0.3]
    result = register(target, source, motion(rng, 2, 0.03))
    assert result.converged
    assert 0.3 < result.overlap < 0.6
    assert error_of(result.T_target_source, np.eye(4))[0] < 0.3


def test_the_same_input_gives_the_same_bits(pair):
    target, source, truth = pair
    first, again = register(target, source, truth), register(Cloud(target), source, truth)
    np.testing.assert_array_equal(first.T_target_source, again.T_target_source)
    np.testing.assert_array_equal(first.information, again.information)


@pytest.mark.parametrize('voxel_size', [None, 0.02])
def test_the_number_of_threads_changes_no_bit(rng, voxel_size):
    target, source = surface(rng, 9000, 0.003), surface(rng, 7000, 0.003)
    start = motion(rng, 3, 0.03)
    one, three = (
        register(target, source, start, RegistrationConfig(voxel_size=voxel_size, threads=n))
        for n in (1, 3)
    )
    np.testing.assert_array_equal(one.T_target_source, three.T_target_source)
    np.testing.assert_array_equal(one.information, three.information)
    assert one.q_tot == three.q_tot


def test_a_prepared_target_is_not_prepared_again(pair):
    target, source, truth = pair
    prepared = Cloud(target)
    config = RegistrationConfig(voxel_size=0.08)
    register(prepared, source, truth, config)
    kept = prepared.reduced(0.08)
    register(prepared, source, truth, config)
    assert prepared.reduced(0.08) is kept


def test_information_is_in_ros_order_and_stiff_where_the_clouds_are(rng):
    """A plane in z: stiff along z and about x and y, loose along x and y and about z."""
    points = np.c_[rng.random((3000, 2)) - 0.5, rng.normal(size=3000) * 0.002]
    result = register(points, points[::-1] + 0)
    stiffness = np.diag(result.information)
    assert stiffness[2] > 10 * max(stiffness[0], stiffness[1])
    assert min(stiffness[3], stiffness[4]) > 5 * stiffness[5]
    np.testing.assert_allclose(result.information, result.information.T, rtol=1e-9)


@pytest.mark.parametrize(
    ('name', 'status'),
    [
        ('disjoint', Status.NO_OVERLAP),
        ('one point', Status.TOO_FEW_POINTS),
        ('collinear', Status.DEGENERATE),
        ('one place', Status.DEGENERATE),
    ],
)
def test_what_cannot_be_registered_has_a_status_and_keeps_the_guess(rng, name, status):
    cloud = surface(rng, 500)
    line = np.outer(np.linspace(0, 1, 100), (1.0, 0, 0))
    target, source = {
        'disjoint': (cloud, cloud + 50),
        'one point': (cloud, cloud[:1]),
        'collinear': (line, line),
        'one place': (np.ones((100, 3)), np.ones((100, 3))),
    }[name]
    guess = np.eye(4)
    result = register(target, source, guess)
    assert result.status is status
    assert not result.converged
    np.testing.assert_allclose(result.T_target_source, guess, atol=1e-12)
    assert np.isfinite([result.q_tot, result.q_mean, result.overlap, result.radius]).all()


def test_a_planar_cloud_is_laid_on_its_plane(rng):
    plane = np.c_[rng.random((2000, 2)), np.zeros(2000)]
    other = np.c_[rng.random((2000, 2)), np.zeros(2000)]
    result = register(plane, other, motion(rng, 2, 0.03))
    normal = result.T_target_source[:3, 2]
    assert np.isfinite(result.T_target_source).all()
    assert abs(normal[2]) > np.cos(np.deg2rad(0.1))
    assert abs(result.T_target_source[2, 3]) < 2e-3


def test_duplicates_of_half_of_all_points_do_no_harm(pair, rng):
    target, source, truth = pair
    doubled = np.vstack([target, target[::2]])
    result = register(doubled, source, truth @ motion(rng, 2, 0.03))
    assert result.converged
    assert error_of(result.T_target_source, truth)[0] < 0.2


def test_steps_that_do_not_suffice_are_a_status(pair, rng):
    target, source, truth = pair
    start = truth @ motion(rng, 4, 0.08)
    result = register(target, source, start, RegistrationConfig(max_iterations=1))
    assert result.status is Status.MAX_ITERATIONS
    assert result.iterations == 3  # one a stage; beyond a deep valley one is left out


def test_the_result_cannot_be_changed(pair):
    target, source, truth = pair
    with pytest.raises(dataclasses.FrozenInstanceError):
        register(target, source, truth).q_tot = 0


def test_misuse_raises(rng):
    with pytest.raises(InvalidCloud, match='shape'):
        register(rng.random((10, 2)), rng.random((10, 3)))
    with pytest.raises(InvalidTransform, match='not rigid'):
        register(rng.random((10, 3)), rng.random((10, 3)), np.diag([2, 1, 1, 1]))


def test_a_coordinate_that_no_sensor_measures_is_left_out(pair):
    target, source, truth = pair
    result = register(np.vstack([target, [[3e38, 0, 0]]]), source, truth)
    assert result.converged
    assert error_of(result.T_target_source, truth)[0] < 0.15


@pytest.mark.parametrize('voxel_size', [None, 0.08])
@pytest.mark.parametrize('far', [1e3, 1e7])
def test_a_stray_point_does_no_harm(pair, rng, far, voxel_size):
    """The mean distance to the fourth neighbour would be its own, and every ball hold all."""
    target, source, truth = pair
    guess, config = truth @ motion(rng, 2, 0.03), RegistrationConfig(voxel_size=voxel_size)
    for stray in ((True, False), (False, True)):
        clouds = (
            np.vstack([[[far, 0, 0]], c]) if s else c for c, s in zip(pair[:2], stray, strict=True)
        )
        result = register(*clouds, guess, config)
        assert result.converged
        assert error_of(result.T_target_source, truth)[0] < 0.3


def test_thousands_of_copies_of_a_point_do_no_harm(pair, rng):
    """As of a driver that pads its clouds: every one of them in the ball of every other."""
    target, source, truth = pair
    padded = np.vstack([target, np.repeat(target[:1], 3000, axis=0)])
    result = register(padded, source, truth @ motion(rng, 2, 0.03))
    assert result.converged
    assert error_of(result.T_target_source, truth)[0] < 0.3


def test_a_far_denser_cloud_is_reduced_to_what_the_radius_resolves(rng):
    sparse, dense = surface(rng, 250, 0.003), surface(rng, 60000, 0.003)
    result = register(dense, sparse, motion(rng, 2, 0.03))
    assert result.converged
    assert error_of(result.T_target_source, np.eye(4))[0] < 1.0


def test_a_stage_wider_than_the_clouds_is_left_out(rng):
    """Eight times the spacing of 250 points is a ball about all of them."""
    sparse, dense = surface(rng, 250, 0.003), surface(rng, 4000, 0.003)
    start = motion(rng, 2, 0.03)
    wide, narrow = (
        register(dense, sparse, start, RegistrationConfig(radius_schedule=schedule))
        for schedule in ((8.0, 4.0, 2.0, 1.0), (4.0, 2.0, 1.0))
    )
    np.testing.assert_array_equal(wide.T_target_source, narrow.T_target_source)
    assert wide.converged


def test_points_given_five_times_each_are_registered_as_once(pair, rng):
    target, source, truth = pair
    guess = truth @ motion(rng, 2, 0.03)
    result = register(np.repeat(target, 5, axis=0), np.repeat(source, 5, axis=0), guess)
    assert result.converged
    assert error_of(result.T_target_source, truth)[0] < 0.3


def test_zeros_that_pad_both_clouds_leave_the_radius_alone(pair, rng):
    target, source, truth = pair
    zeros = np.zeros((len(target), 3))
    alone = register(target, source, truth)
    padded = register(np.vstack([target, zeros]), np.vstack([source, zeros]), truth)
    assert padded.radius == pytest.approx(alone.radius, rel=0.1)
    assert padded.assessment.verdict is alone.assessment.verdict


def test_masked_points_are_left_out(pair):
    target, source, truth = pair
    masked = np.ma.masked_array(np.vstack([target, target + 0.3]))
    masked[len(target) :] = np.ma.masked
    there = register(masked, source, truth).T_target_source
    np.testing.assert_array_equal(there, register(target, source, truth).T_target_source)


def test_the_path_of_a_result_leads_from_its_first_step_to_its_pose(rng):
    target, source = surface(rng, 600), surface(rng, 500)
    result = register(target, source, motion(rng, 2.0, 0.02))
    assert 0 < len(result.path) <= result.iterations
    np.testing.assert_allclose(result.path[-1], result.T_target_source, rtol=0, atol=1e-12)
