from functools import partial

import numpy as np
import pytest

from benchmarks.ablate_cases import Unseen
from benchmarks.bare_scenes import bare_case
from benchmarks.conditions import condition
from benchmarks.trust.fit import (
    best_threshold,
    calibration_error,
    fitted,
    fitted_confidence,
    left_out,
    roc_area,
)
from benchmarks.trust.freedom import freedom
from benchmarks.trust.measure import verdict_goals
from benchmarks.trust.places import PLACES
from benchmarks.trust.places_spread import place_goals
from benchmarks.trust.poses import PEER_SCORES, Judged, judged_poses
from benchmarks.trust.scenes import simulated
from benchmarks.trust.sensors import place_case
from benchmarks.trust.shipped import said_of, shipped_goals
from benchmarks.trust.spread import Spread, spread, worst_coverage
from benchmarks.trust.ways import Way, ways
from idem_ros.core.trust.basin import LAST
from idem_ros.core.trust.verdict import BEYOND, probability

SIMILAR = partial(condition, 'similar', 7)


def judged(kind, right, numbers, peer=0.0):
    return Judged(kind, 'near', right, *numbers, 0.5, '', (peer,) * len(PEER_SCORES))


@pytest.fixture
def poses(rng):
    """Two kinds of scene, in which the right poses have no discord, and the wrong ones much."""
    found = []
    for kind in ('a', 'b'):
        for right in (True, False):
            for _ in range(50):
                discord = rng.uniform(0.1, 0.3) if right else rng.uniform(0.8, 1.5)
                numbers = discord, rng.random(), rng.uniform(0.1, 1.0), rng.random()
                found.append(judged(kind, right, numbers, rng.normal()))
    return found


def test_a_model_fitted_to_one_kind_judges_another(poses):
    for kind, p in left_out(poses).items():
        right = np.array([each.right for each in poses if each.kind == kind])
        assert ((p > 0.5) == right).all()


def test_the_fit_recovers_a_model_that_made_the_labels(rng):
    true = np.array([-6.0, 3.0, 4.0, BEYOND, 3.5])
    numbers = rng.uniform([0.0, -0.5, 0.1, 1.0], [1.5, 1.0, 1.0, 4.0], (8000, 4))
    right = rng.random(len(numbers)) < probability(*numbers.T, true)
    found = fitted([judged('a', bool(r), n) for r, n in zip(right, numbers, strict=True)])
    np.testing.assert_allclose(found[:3], true[:3], rtol=0.15)


def test_confidence_is_fitted_back_to_what_foretold(rng):
    told = rng.uniform(0.01, 0.99, 5000)
    found = fitted_confidence([Way('a', bool(rng.random() < p), p) for p in told])
    np.testing.assert_allclose(found, LAST, rtol=0.1)


def test_calibration_error_is_the_mean_gap_of_the_bins():
    p = np.array([0.05, 0.05, 0.95, 0.95])
    assert calibration_error(p, [False, False, True, True]) == pytest.approx(0.05)
    assert calibration_error(p, [True, True, False, False]) == pytest.approx(0.95)


def test_the_area_and_the_threshold_are_those_of_plain_counting(rng):
    score, right = rng.integers(0, 6, 60).astype(float), rng.random(60) < 0.5
    pairs = [(a > b) + 0.5 * (a == b) for a in score[right] for b in score[~right]]
    assert roc_area(score, right) == pytest.approx(np.mean(pairs))
    correct = [np.sum((score > t) == right) for t in (-np.inf, *score)]
    assert np.sum((score > best_threshold(score, right)) == right) == max(correct)


def test_goals_of_the_verdict_tell_wrong_ones_by_kind_and_against_peers(poses):
    goals = {goal.figure: goal for goal in verdict_goals(poses)}
    assert goals['cross-validated verdict: wrong, of 100 in a'].measured == 0.0
    beside = [goal for name, goal in goals.items() if 'inlier RMSE' in name]
    assert beside[0].measured == 0.0
    broken = [each._replace(right=not each.right) for each in poses[:10]] + poses[10:]
    assert not next(iter(verdict_goals(broken))).reached


def test_coverage_is_held_against_the_normal_distribution(rng):
    good = [Spread('a', sigmas, 6.0) for sigmas in rng.normal(size=(4000, 6))]
    assert worst_coverage(good) < 2.5
    assert worst_coverage([each._replace(sigmas=2 * each.sigmas) for each in good]) > 25


def test_poses_of_a_case_are_labelled_by_the_truth():
    pytest.importorskip('small_gicp')
    found = judged_poses('objects', SIMILAR)
    assert {each.right for each in found} >= {True, False}
    assert np.mean([each.p_aligned for each in found if each.right]) > 0.9
    assert np.mean([each.p_aligned for each in found if each.right is False]) < 0.2


def test_one_trial_of_each_other_kind():
    assert 0 < spread('objects', SIMILAR).nees < 60
    foretold = ways('objects', SIMILAR)
    assert {each.success for each in foretold} == {True, False}
    trial = freedom('corridor', 1)
    assert trial.found
    assert 0 <= trial.drift < 0.02


def test_scenes_are_all_different():
    cases = simulated(3)
    assert len(cases) == 6
    names = [
        build().name for builders in (cases['objects'], cases['corridors']) for build in builders
    ]
    assert len(set(names)) == len(names)
    assert bare_case('plane', 0).name not in names


def test_what_is_said_of_a_place_from_near_and_far_displaced_and_in_a_mirror():
    found = said_of('woods', Unseen('woods', partial(place_case, 'woods', 7005)))
    by_how = {each.how: each for each in found}
    assert set(by_how) == {'near', 'displaced', 'within', 'far', 'mirrored'}
    assert by_how['near'].right
    assert by_how['near'].usable
    assert by_how['within'].usable
    assert not by_how['displaced'].usable
    goals = {goal.figure: goal for goal in shipped_goals(found)}
    assert goals['shipped: right and not called so, of 1 in woods'].reached
    wrong = [each._replace(right=False, verdict='aligned') for each in found]
    missed = [goal for goal in shipped_goals(wrong) if not goal.reached]
    assert len(missed) >= 4


def test_the_covariance_of_a_kind_of_place_is_held_against_its_own_goals(rng):
    good = [Spread('field', sigmas, 6.0) for sigmas in rng.normal(size=(2000, 6))]
    assert all(goal.reached for goal in place_goals(good))
    narrow = [each._replace(sigmas=2 * each.sigmas, nees=24.0) for each in good]
    assert sum(not goal.reached for goal in place_goals(narrow)) == 3


@pytest.mark.parametrize('kind', ['street', *PLACES])
def test_places_are_seen_by_every_pattern_and_differ_by_seed(kind):
    cases = [place_case(kind, seed) for seed in (0, 5)]
    assert min(len(case.target) for case in cases) > 2000
    assert 0.1 < np.linalg.norm(cases[0].truth[:3, 3]) < 2.5
    assert len(cases[0].target) != len(cases[1].target)
