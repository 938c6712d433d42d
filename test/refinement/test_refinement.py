from dataclasses import replace

import numpy as np
import pytest
from clouds import motion, surface
from recordings import scans

from idem_ros.core import (
    InvalidCloud,
    RegistrationConfig,
    Status,
    q_tot,
    register,
)
from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.pair import Pair
from idem_ros.recording.messages import cloud_message
from idem_ros.refinement import prepared_cloud
from idem_ros.refinement.diagnostics import OK, WARN, level, reason, refinement_values
from idem_ros.refinement.prepared_cloud import prepared
from idem_ros.refinement.preprocessing import PreprocessingConfig, preprocess
from idem_ros.refinement.refiner import Refiner


def guess_of(message):
    return Guess(matrix_of(message), message.header.frame_id, message.child_frame_id)


@pytest.fixture
def pair(rng):
    (_, _, target), (_, _, source), (_, _, guess), _ = scans(rng, n=1)
    return Pair(target, source, guess_of(guess))


def test_the_result_is_that_of_the_core(rng):
    clouds = [surface(rng, 300).astype(np.float32).astype(np.float64) for _ in range(2)]
    guess = motion(rng, 2.0, 0.02)
    pair = Pair(
        cloud_message(clouds[0], 1, 'map'),
        cloud_message(clouds[1], 2, 'lidar'),
        Guess(guess, 'map', 'lidar'),
    )
    refined = Refiner().refine(pair)
    expected = register(*clouds, refined.T_guess)
    np.testing.assert_array_equal(refined.result.T_target_source, expected.T_target_source)
    np.testing.assert_allclose(refined.T_guess, guess, atol=1e-12)
    assert (refined.stamp, refined.points_target, refined.points_source) == (2, 300, 300)
    assert (refined.target_frame, refined.source_frame) == ('map', 'lidar')


def test_the_covariance_of_a_guess_is_weighed_as_the_core_does(pair):
    guess = replace(pair.guess, covariance=1e-6 * np.eye(6))
    refined = Refiner().refine(replace(pair, guess=guess))
    clouds = [read_points(cloud).points for cloud in (pair.target, pair.source)]
    expected = register(*clouds, refined.T_guess, guess_covariance=guess.covariance)
    np.testing.assert_allclose(
        refined.result.assessment.covariance, expected.assessment.covariance, rtol=1e-9
    )
    plain = Refiner().refine(pair).result.assessment
    assert refined.result.assessment.reason != plain.reason or not np.allclose(
        refined.result.assessment.covariance, plain.covariance
    )


@pytest.mark.parametrize('voxel_size', [None, 0.1])
def test_q_tot_before_is_comparable_with_q_tot_after(pair, voxel_size):
    config = RegistrationConfig(voxel_size=voxel_size)
    refined = Refiner(config, judge_guess=True).refine(pair)
    from_result = replace(pair, guess=Guess(refined.result.T_target_source))
    again = Refiner(replace(config, max_iterations=1), judge_guess=True).refine(from_result)
    assert again.q_tot_before == pytest.approx(refined.result.q_tot, rel=1e-6)
    assert refined.result.q_tot < refined.q_tot_before


def test_q_tot_before_is_that_of_the_metric(pair):
    refined = Refiner(judge_guess=True).refine(pair)
    points = [read_points(cloud).points for cloud in (pair.target, pair.source)]
    expected = q_tot(*points, refined.T_guess, radius=refined.result.radius)
    assert refined.q_tot_before == pytest.approx(expected, rel=1e-12)


def test_a_target_that_stays_is_read_once(pair, monkeypatch):
    read = []
    monkeypatch.setattr(
        prepared_cloud,
        'read_points',
        lambda message, times: read.append(message) or read_points(message, times),
    )
    refiner = Refiner()
    first, second = refiner.refine(pair), refiner.refine(pair)
    assert [message is pair.target for message in read] == [True, False, False]
    np.testing.assert_array_equal(first.result.T_target_source, second.result.T_target_source)
    refiner.refine(replace(pair, target=pair.source))
    assert read[-2] is pair.source


def test_a_bad_target_does_not_leave_the_one_before_in_its_place(pair):
    refiner = Refiner()
    refiner.refine(pair)
    for _ in range(2):
        with pytest.raises(InvalidCloud, match='^target: none of its 1 points'):
            refiner.refine(replace(pair, target=cloud_message(np.zeros((1, 3)), 1, 'map')))
    assert refiner.refine(pair).result.status is Status.CONVERGED


def test_a_refused_source_is_named(pair):
    with pytest.raises(InvalidCloud, match='^source: none of its 2 points'):
        Refiner().refine(replace(pair, source=cloud_message(np.zeros((2, 3)), 1, 'lidar')))


def test_the_last_result_is_the_guess_of_the_next_and_the_identity_of_the_first(pair):
    last = replace(pair, guess=Guess(None))
    refiner = Refiner()
    assert (refiner.refine(last).T_guess == np.eye(4)).all()
    first = refiner.refine(pair).result
    np.testing.assert_array_equal(refiner.refine(last).T_guess, first.T_target_source)


def test_a_first_pose_serves_until_there_is_a_result(pair):
    first = exp(np.array([0.0, 0.0, 0.01, 0.02, 0.0, 0.0]))
    last = replace(pair, guess=Guess(None, T_first=first))
    refiner = Refiner()
    few = replace(last, source=cloud_message(np.eye(3), 1, 'lidar'))
    np.testing.assert_array_equal(refiner.refine(few).T_guess, first)
    good = refiner.refine(last)
    np.testing.assert_array_equal(good.T_guess, first)
    assert good.result.converged
    np.testing.assert_array_equal(refiner.refine(last).T_guess, good.result.T_target_source)


def test_after_a_failure_the_last_good_result_is_the_guess(pair):
    last = replace(pair, guess=Guess(None))
    refiner = Refiner()
    good = refiner.refine(pair).result.T_target_source
    few = replace(last, source=cloud_message(np.eye(3), 1, 'lidar'))
    assert refiner.refine(few).result.status is Status.TOO_FEW_POINTS
    with pytest.raises(InvalidCloud):
        refiner.refine(replace(last, source=cloud_message(np.zeros((2, 3)), 1, 'lidar')))
    np.testing.assert_array_equal(refiner.refine(last).T_guess, good)


@pytest.mark.parametrize('what', ['frame', 'clock'])
def test_a_result_of_other_frames_or_of_before_the_clock_went_back_is_no_guess(pair, what):
    last = replace(pair, guess=Guess(None), jumps=int(what == 'clock'))
    refiner = Refiner()
    refiner.refine(pair)
    if what == 'frame':
        last.source.header.frame_id = 'other'
    assert (refiner.refine(last).T_guess == np.eye(4)).all()


def test_frames_that_the_clouds_leave_empty_come_from_the_guess(pair):
    pair.target.header.frame_id = pair.source.header.frame_id = ''
    refined = Refiner().refine(pair)
    assert (refined.target_frame, refined.source_frame) == ('map', 'lidar')


def test_points_left_out_of_both_clouds_are_counted(rng):
    points = surface(rng, 60)
    target, source = points.copy(), transform_points(inverse(motion(rng, 1.0, 0.0)), points)
    target[:3], source[:2], source[2] = np.nan, 0.0, np.inf
    pair = Pair(
        cloud_message(target, 1, ''),
        cloud_message(source, 1, ''),
        Guess(np.eye(4)),
    )
    refined = Refiner().refine(pair)
    assert (refined.dropped_nonfinite, refined.dropped_zero) == (4, 2)
    assert (refined.points_target, refined.points_source) == (57, 57)


def test_points_left_out_on_request_take_no_part_and_are_counted(pair):
    config = PreprocessingConfig(crop_min=(0.0, -9.0, -9.0), crop_target=True, max_points=150)
    refined = Refiner(preprocessing=config).refine(pair)
    read = [read_points(cloud).points for cloud in (pair.target, pair.source)]
    kept = [preprocess(points, config, is_target=True) for points in read]
    expected = register(*(each.points for each in kept), refined.T_guess)
    np.testing.assert_array_equal(refined.result.T_target_source, expected.T_target_source)
    assert refined.points_target == len(kept[0].points)
    assert refined.points_source == len(kept[1].points)
    assert refined.cropped == sum(each.cropped for each in kept) > 0
    assert refined.thinned == sum(each.thinned for each in kept) > 0
    values = refinement_values(refined, dropped=0)
    assert (values['cropped'], values['thinned']) == (str(refined.cropped), str(refined.thinned))


def test_a_cloud_with_nothing_left_is_refused_by_its_name_and_that_of_the_parameter(pair):
    config = PreprocessingConfig(min_range=100.0)
    with pytest.raises(InvalidCloud, match='^source: none of its 400 points.*min_range 100.0 m'):
        Refiner(preprocessing=config).refine(pair)


def test_other_parameters_hold_from_the_next_refinement_on(pair, monkeypatch):
    read = []
    monkeypatch.setattr(
        prepared_cloud,
        'read_points',
        lambda message, times: read.append(message) or read_points(message, times),
    )
    refiner = Refiner()
    refiner.refine(pair)
    refiner.configure(RegistrationConfig(max_iterations=1), PreprocessingConfig())
    assert refiner.refine(pair).result.status is Status.MAX_ITERATIONS
    assert sum(message is pair.target for message in read) == 1
    refiner.configure(RegistrationConfig(), PreprocessingConfig(max_points=100))
    assert refiner.refine(pair).points_target == 100
    assert sum(message is pair.target for message in read) == 2


def test_too_few_points_are_a_status(pair):
    few = cloud_message(np.eye(3), 1, 'lidar')
    refined = Refiner(judge_guess=True).refine(replace(pair, source=few))
    assert refined.result.status is Status.TOO_FEW_POINTS
    assert refined.q_tot_before == 0.0
    assert level(refined) == WARN


def test_diagnostics_say_in_strings_what_came_out(pair):
    refined = Refiner().refine(pair)
    values = refinement_values(refined, dropped=3)
    assert list(values) == [
        *('q_tot', 'q_mean', 'overlap', 'overlap_source', 'overlap_target'),
        *('radius', 'voxel_size'),
        *('iterations', 'status', 'reason', 'milliseconds'),
        *('verdict', 'verdict_reason', 'p_aligned', 'free_motions', 'basin', 'swap_gap'),
        *('sigma_xyz_m', 'sigma_xyz_rad'),
        *('reading_ms', 'preparing_ms', 'registering_ms', 'judging_ms'),
        *('points_target', 'points_source', 'cropped', 'thinned', 'dropped'),
    ]
    assert all(isinstance(value, str) for value in values.values())
    assert float(values['q_tot']) == refined.result.q_tot
    assert (values['status'], values['dropped']) == ('converged', '3')
    assert level(refined) == OK


def test_every_status_has_a_reason_in_words(pair):
    refined = Refiner().refine(pair)
    for status in Status:
        assert len(reason(replace(refined.result, status=status)).split()) > 3


def test_time_is_that_of_the_stages_and_a_kept_target_costs_nothing_again(pair, monkeypatch):
    refiner = Refiner(judge_guess=True)
    first, second = refiner.refine(pair), refiner.refine(pair)
    for refined in (first, second):
        assert min(refined.times) > 0.0
        assert sum(refined.times[:3]) <= refined.time_ms
    alone = prepared('source', pair.source, PreprocessingConfig())
    assert set(map(type, (*first.times, alone.reading_ms, alone.preparing_ms))) == {float}
    for module in ('refiner', 'prepared_cloud'):
        monkeypatch.setattr(
            f'idem_ros.refinement.{module}.prepared',
            lambda role, *given, **options: replace(
                prepared(role, *given, **options),
                reading_ms={'target': 100.0, 'source': 7.0}[role],
            ),
        )
    fresh = Refiner()
    assert [fresh.refine(pair).times.reading for _ in range(2)] == [107.0, 7.0]


def test_a_refinement_carries_what_it_is_made_of(pair):
    refined = Refiner().refine(pair)
    points = [refined.points_target, refined.points_source]
    assert [len(cloud) for cloud in refined.took_part[:2]] == points
    assert refined.took_part.config == RegistrationConfig(voxel_size=None)  # so few: as given
