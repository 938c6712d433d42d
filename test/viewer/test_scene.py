import numpy as np
import pytest

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.viewer import scene as module
from idem_ros.viewer.scene import scene_of

T_TRUTH = exp(np.array([0.0, 0.0, 0.1, 0.3, -0.2, 0.05]))


def room(rng, n, floor_only=False):
    """Points of the floor and two walls of a box of 4 m."""
    points = rng.uniform(0, 4, (n, 3))
    side = np.zeros(n, int) if floor_only else rng.integers(0, 3, n)
    points[np.arange(n), 2 - side] = rng.normal(0, 0.005, n)
    return points


@pytest.fixture(scope='module')
def shown():
    rng = np.random.default_rng(4)
    target, source = room(rng, 3000), transform_points(inverse(T_TRUTH), room(rng, 2000))
    guess = exp(np.array([0.0, 0.0, 0.12, 0.35, -0.2, 0.05]))
    return target, source, guess, scene_of('x', target, source, guess, RegistrationConfig())


def test_the_clouds_meet_at_the_refined_pose_and_not_at_the_guess(shown):
    target, source, guess, scene = shown
    middle = np.median(transform_points(T_TRUTH, source), axis=0)
    ends = scene.poses[0], scene.poses[-1]
    at_guess, refined = (transform_points(pose, scene.source) for pose in ends)
    assert np.allclose(at_guess, transform_points(guess, source) - middle, atol=0.01)
    assert np.allclose(refined, transform_points(T_TRUTH, source) - middle, atol=0.01)
    assert np.allclose(scene.target, target - middle, atol=0.01)


def test_each_step_of_the_solve_is_shown_and_leads_nearer(shown):
    target, source, guess, scene = shown
    off = [np.abs(pose - scene.poses[-1]).max() for pose in scene.poses]
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
    assert len(scene.means) == len(scene.q)
    assert scene.q.sum() == pytest.approx(float(scene.values['q_tot']), rel=1e-3)


def test_motions_that_a_floor_leaves_free_are_shown():
    rng = np.random.default_rng(5)
    target, source = room(rng, 2000, floor_only=True), room(rng, 2000, floor_only=True)
    scene = scene_of('x', target, source, np.eye(4), RegistrationConfig())
    assert len(scene.free) == 3
    assert np.abs(scene.free[:, 2:5]).max() < 0.1  # along x and y, about z


def test_a_large_cloud_is_thinned_and_the_scene_says_how(monkeypatch, shown):
    target, source, guess, _ = shown
    monkeypatch.setattr(module, 'MOST_POINTS', 1000)
    scene = scene_of('x', target, source, guess, RegistrationConfig())
    assert (len(scene.target), len(scene.source)) == (1000, 1000)
    assert scene.every == (3, 2)


def test_too_few_points_are_shown_without_curves():
    few = np.eye(3)
    scene = scene_of('x', few, few, np.eye(4), RegistrationConfig())
    assert scene.curves == ()
    assert scene.values['status'] == 'too_few_points'
