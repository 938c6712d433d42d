import base64
import json

import numpy as np
import pytest

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.viewer import scene as module
from idem_ros.viewer.scene import scene_of, view_of

T_TRUTH = exp(np.array([0.0, 0.0, 0.1, 0.3, -0.2, 0.05]))


def room(rng, n, floor_only=False):
    """Points of the floor and two walls of a box of 4 m."""
    points = rng.uniform(0, 4, (n, 3))
    side = np.zeros(n, int) if floor_only else rng.integers(0, 3, n)
    points[np.arange(n), 2 - side] = rng.normal(0, 0.005, n)
    return points


def in_order(points):
    """Each axis by itself: points of a view are in random order."""
    return np.sort(points, axis=0)


@pytest.fixture(scope='module')
def shown():
    rng = np.random.default_rng(4)
    target, source = room(rng, 3000), transform_points(inverse(T_TRUTH), room(rng, 2000))
    guess = exp(np.array([0.0, 0.0, 0.12, 0.35, -0.2, 0.05]))
    return target, source, guess, scene_of('x', target, source, guess, RegistrationConfig())


def test_the_clouds_meet_at_the_refined_pose_and_not_at_the_guess(shown):
    target, source, guess, scene = shown
    middle = np.median(transform_points(T_TRUTH, source), axis=0)
    view = scene.view
    ends = view.poses[0], view.poses[-1]
    at_guess, refined = (in_order(transform_points(pose, view.source)) for pose in ends)
    assert np.allclose(at_guess, in_order(transform_points(guess, source) - middle), atol=0.01)
    assert np.allclose(refined, in_order(transform_points(T_TRUTH, source) - middle), atol=0.01)
    assert np.allclose(in_order(view.target), in_order(target - middle), atol=0.01)


def test_each_step_of_the_solve_is_shown_and_leads_nearer(shown):
    target, source, guess, scene = shown
    off = [np.abs(pose - scene.view.poses[-1]).max() for pose in scene.view.poses]
    assert len(off) > 4
    assert off[0] > 10 * off[-2]
    assert off[-2] < 1e-3


def test_a_curve_has_a_valley_at_the_result_and_says_where_the_guess_was(shown):
    *_, guess, scene = shown
    assert [curve.axis for curve in scene.curves] == ['x', 'y', 'z', 'rx', 'ry', 'rz']
    for curve in scene.curves:
        middle = len(curve.offsets) // 2  # far away the clouds are separate, and q_tot is 0 again
        assert curve.q_tot[middle] < min(curve.q_tot[middle - 4], curve.q_tot[middle + 4])
        assert curve.offsets[0] < curve.guess < curve.offsets[-1]
        assert all(curve.offsets[0] <= crest <= curve.offsets[-1] for crest in curve.crests)
    assert scene.curves[5].guess == pytest.approx(np.degrees(0.02), abs=0.05)


def test_what_the_points_add_to_q_tot_is_its_sum(shown):
    scene = shown[-1]
    assert len(scene.view.means) == len(scene.view.q)
    assert scene.view.q.sum() == pytest.approx(float(scene.values['q_tot']), rel=1e-3)


def test_motions_that_a_floor_leaves_free_are_shown():
    rng = np.random.default_rng(5)
    target, source = room(rng, 2000, floor_only=True), room(rng, 2000, floor_only=True)
    scene = scene_of('x', target, source, np.eye(4), RegistrationConfig())
    assert len(scene.view.free) == 3
    assert np.abs(scene.view.free[:, 2:5]).max() < 0.1  # along x and y, about z


def test_a_large_cloud_is_thinned_and_the_scene_says_how(monkeypatch, shown):
    target, source, guess, _ = shown
    monkeypatch.setattr(module, 'MOST_POINTS', 1000)
    scene = scene_of('x', target, source, guess, RegistrationConfig())
    assert (len(scene.view.target), len(scene.view.source)) == (1000, 1000)
    assert scene.view.of == (3000, 2000)


def test_the_first_points_are_an_even_sample_and_the_same_every_time(shown):
    target, source, guess, scene = shown
    first = scene.view.target[:300]
    assert np.allclose(first.mean(axis=0), scene.view.target.mean(axis=0), atol=0.3)
    again = view_of(target, source, (guess, T_TRUTH), 300)
    once_more = view_of(target, source, (guess, T_TRUTH), 300)
    np.testing.assert_array_equal(again.target, once_more.target)


def test_of_a_large_map_what_lies_around_the_source_is_shown(rng):
    source = room(rng, 500)
    far = source + (1000, 0, 0)
    view = view_of(np.vstack([source, far]), source, (np.eye(4), np.eye(4)), 2000)
    assert view.of == (500, 500)
    assert np.abs(view.target).max() < 10


def test_a_source_that_reaches_nothing_is_shown_with_all_of_the_target(rng):
    source = room(rng, 100)
    view = view_of(source + (1000, 0, 0), source, (np.eye(4), np.eye(4)), 2000)
    assert view.of == (100, 100)


def test_what_the_script_reads_is_json_without_markup(shown):
    text = shown[-1].view.as_json()
    record = json.loads(text)
    assert '<' not in text
    assert len(base64.b64decode(record['source'])) == 2000 * 12
    assert record['names'][0] == 'at the guess'
    assert len(record['names']) == len(record['poses'])


def test_too_few_points_are_shown_without_curves():
    few = np.eye(3)
    scene = scene_of('x', few, few, np.eye(4), RegistrationConfig())
    assert scene.curves == ()
    assert scene.values['status'] == 'too_few_points'
