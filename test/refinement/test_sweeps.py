import itertools
from dataclasses import replace

import numpy as np
import pytest
from clouds import error_of
from poses import odometry
from sweeps import (
    FRAMES,
    PERIOD,
    START,
    SWEEP,
    TWIST,
    driven,
    map_message,
    sweep_message,
    uneven,
)

from idem_ros.core import RegistrationConfig, undistort
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.pairing.guesses import Guess, GuessConfig, UncoveredSweep
from idem_ros.pairing.pair import Pair
from idem_ros.pairing.streamed_guesses import StreamedGuesses
from idem_ros.refinement.diagnostics import motion_record, refinement_values
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refiner

CONFIG = RegistrationConfig(voxel_size=0.08)
STAMP = START + PERIOD


def guess_at(stamp, path, offsets):
    """The guess for a stamp, of a stream with messages at so many seconds from the stamp."""
    guesses = StreamedGuesses()
    for offset in offsets:
        pose = path((stamp - START) / 1e9 + offset)
        guesses.add(odometry(stamp + round(1e9 * offset), pose, *FRAMES))
    return guesses.guess_for(stamp, *FRAMES, GuessConfig(type='odometry'))


def pair_at(rng, path, offsets, stamp=STAMP, target=None, **sweep):
    source = sweep_message(rng, path, stamp, **sweep)
    return Pair(target or map_message(rng), source, guess_at(stamp, path, offsets))


def points_of(message):
    read = read_points(message, PointTimeConfig())
    return read.points, read.times.times


EVERY_20_MS = np.round(np.arange(-0.1, 0.161, 0.02), 6)


@pytest.mark.parametrize('begin', [0.0, -SWEEP, -SWEEP / 2])
def test_the_motion_between_guesses_is_undone_at_the_time_of_each_point(rng, begin):
    pair = pair_at(rng, uneven, EVERY_20_MS, begin=begin)
    truth = uneven(PERIOD / 1e9)
    undone = Refiner(replace(CONFIG, motion='guess')).refine(pair)
    as_it_is = Refiner(CONFIG).refine(pair)
    degrees, distance = error_of(undone.result.T_target_source, truth)
    assert degrees < 0.15
    assert distance < 0.003
    assert error_of(as_it_is.result.T_target_source, truth)[1] > 3 * distance
    assert undone.result.moved > 0.01
    assert undone.result.motion_flaw == ''
    assert as_it_is.result.twist is None


def test_the_result_tells_the_twist_of_the_sweep(rng):
    pair = pair_at(rng, driven, EVERY_20_MS)
    result = Refiner(replace(CONFIG, motion='guess')).refine(pair).result
    np.testing.assert_allclose(result.twist, TWIST, atol=1e-4)


@pytest.mark.parametrize(
    ('reference', 'seconds'), [('stamp', 0.0), ('begin', 0.0), ('middle', 0.05), ('end', 0.1)]
)
def test_the_pose_is_that_of_the_reference_and_has_its_time(rng, reference, seconds):
    config = replace(CONFIG, motion='guess', motion_reference=reference)
    refinement = Refiner(config).refine(pair_at(rng, driven, EVERY_20_MS))
    assert refinement.instant == pytest.approx(STAMP + 1e9 * seconds, abs=1e6)
    truth = driven((refinement.instant - START) / 1e9)
    assert error_of(refinement.result.T_target_source, truth)[1] < 0.003
    assert error_of(refinement.T_guess, truth)[1] < 1e-4


def test_guesses_that_end_a_little_before_the_sweep_are_taken_to_go_on(rng):
    pair = pair_at(rng, driven, [-0.04, -0.02, 0.0])
    result = Refiner(replace(CONFIG, motion='guess')).refine(pair).result
    np.testing.assert_allclose(result.twist, TWIST, atol=1e-4)


@pytest.mark.parametrize(
    ('offsets', 'begin', 'why'),
    [
        ([-0.1, 0.0], 0.0, 'end before the sweep does, by 0.3 s'),
        ([0.0, 0.1], -0.3, 'begin after the sweep does, by 0.3 s'),
        ([0.0], 0.0, 'of the sweep 1 poses came'),
    ],
)
def test_guesses_that_do_not_reach_over_the_sweep_are_refused_and_the_gap_is_named(
    rng, offsets, begin, why
):
    pair = pair_at(rng, driven, offsets, begin=begin, duration=0.3)
    with pytest.raises(UncoveredSweep, match=why):
        Refiner(replace(CONFIG, motion='guess')).refine(pair)


def test_a_source_without_times_is_registered_as_it_is_and_why_is_said(rng):
    pair = pair_at(rng, driven, EVERY_20_MS, timed=False)
    result = Refiner(replace(CONFIG, motion='guess')).refine(pair).result
    expected = Refiner(CONFIG).refine(pair).result
    np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)
    assert result.motion_flaw == 'the source has no times of its points'
    assert result.twist is None


@pytest.mark.parametrize('guess', [Guess(np.eye(4)), Guess(np.eye(4), is_timeless=True)])
def test_a_guess_that_comes_alone_tells_no_motion_and_that_is_said(rng, guess):
    pair = replace(pair_at(rng, driven, EVERY_20_MS), guess=guess)
    result = Refiner(replace(CONFIG, motion='guess')).refine(pair).result
    assert result.motion_flaw == 'the guess comes alone, without others before and after it'


def test_the_motion_from_one_usable_result_to_the_next_goes_on(rng):
    refiner = Refiner(replace(CONFIG, motion='last'))
    target, found = map_message(rng), []
    for k in range(8):
        stamp = START + k * PERIOD
        found.append(refiner.refine(pair_at(rng, driven, EVERY_20_MS, stamp, target)))
    assert 'two usable results' in found[0].result.motion_flaw
    assert found[1].result.twist is None
    for k in (6, 7):
        truth = driven(k * PERIOD / 1e9)
        assert error_of(found[k].result.T_target_source, truth)[1] < 0.004
        np.testing.assert_allclose(found[k].result.twist, TWIST, atol=0.1)


def test_a_sweep_without_times_is_where_it_was_found_at_the_middle_that_others_have(rng):
    refiner, target = Refiner(replace(CONFIG, motion='last')), map_message(rng)
    for k in range(8):
        stamp = START + k * PERIOD
        pair = pair_at(rng, driven, EVERY_20_MS, stamp, target, timed=k != 6)
        result = refiner.refine(pair).result
        assert (result.twist is None) == (k in (0, 1, 6))
    assert np.linalg.norm(result.twist[:3] - TWIST[:3]) < 0.4  # twice as fast by its stamp


def test_a_motion_from_long_ago_is_none(rng):
    refiner, target = Refiner(replace(CONFIG, motion='last')), map_message(rng)
    for k in (0, 1, 14):
        stamp = START + k * PERIOD
        result = refiner.refine(pair_at(rng, driven, EVERY_20_MS, stamp, target)).result
    assert result.motion_flaw == 'the last usable result is 1.25 s before the source'


def scans(rng, count):
    return [sweep_message(rng, driven, START + k * PERIOD) for k in range(count)]


@pytest.mark.parametrize('kind', ['guess', 'last'])
def test_of_scan_to_scan_the_target_is_undone_by_what_was_found_of_it(rng, kind):
    refiner, step = Refiner(replace(CONFIG, motion=kind)), driven(PERIOD / 1e9)
    sweeps = scans(rng, 5)
    for target, source in itertools.pairwise(sweeps):
        guess = Guess(step, FRAMES[1], FRAMES[1])
        result = refiner.refine(Pair(target, source, guess)).result
    degrees, distance = error_of(result.T_target_source, step)
    assert degrees < 0.3
    assert distance < 0.006
    np.testing.assert_allclose(result.twist, TWIST, atol=0.1)


def test_other_points_left_out_take_their_times_with_them(rng):
    pair = pair_at(rng, driven, EVERY_20_MS)
    left_out = PreprocessingConfig(crop_min=(-0.3, -9.0, -9.0), max_points=1200)
    refined = Refiner(replace(CONFIG, motion='guess'), preprocessing=left_out).refine(pair)
    assert refined.cropped > 0
    assert refined.thinned > 0
    assert error_of(refined.result.T_target_source, driven(PERIOD / 1e9))[1] < 0.005


def test_a_motion_that_nobody_tells_is_solved_for_with_the_pose(rng):
    pair = replace(pair_at(rng, driven, EVERY_20_MS), guess=Guess(driven(PERIOD / 1e9)))
    refined = Refiner(replace(CONFIG, motion='solve'), judge_guess=True).refine(pair)
    assert error_of(refined.result.T_target_source, driven(PERIOD / 1e9))[1] < 0.005
    np.testing.assert_allclose(refined.result.twist, TWIST, atol=0.5)
    still = undistort(*points_of(pair.source), refined.result.twist, 'stamp')
    took_part = refined.took_part.source
    np.testing.assert_allclose(took_part.points + took_part.origin, still, atol=1e-6)
    record = motion_record(refined.result, refined.reference)
    sigmas = np.sqrt(np.diag(record['twist_covariance']))
    assert (np.abs(refined.result.twist - TWIST) < 4.0 * sigmas).all()
    assert len(refinement_values(refined, 0)['sigma_twist'].split()) == 6


def test_a_solve_of_scans_goes_on_from_the_motion_found_last(rng):
    refiner = Refiner(replace(CONFIG, motion='solve'))
    for target, source in itertools.pairwise(scans(rng, 4)):
        guess = Guess(driven(PERIOD / 1e9), FRAMES[1], FRAMES[1])
        result = refiner.refine(Pair(target, source, guess)).result
    assert error_of(result.T_target_source, driven(PERIOD / 1e9))[1] < 0.01
    np.testing.assert_allclose(result.twist, TWIST, atol=0.2)


def test_to_a_scan_that_could_not_be_undone_no_motion_is_solved(rng):
    refiner = Refiner(replace(CONFIG, motion='solve'))
    sweeps = [sweep_message(rng, driven, START + k * PERIOD, timed=k != 3) for k in range(5)]
    for target, source in itertools.pairwise(sweeps):
        guess = Guess(driven(PERIOD / 1e9), FRAMES[1], FRAMES[1])
        result = refiner.refine(Pair(target, source, guess)).result
    np.testing.assert_allclose(result.twist, TWIST, atol=1e-6)  # as the guess has it


def test_a_solve_needs_no_guesses_over_the_sweep(rng):
    refined = Refiner(replace(CONFIG, motion='solve')).refine(pair_at(rng, driven, [0.0]))
    assert error_of(refined.result.T_target_source, driven(PERIOD / 1e9))[1] < 0.005
