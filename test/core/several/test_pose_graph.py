import numpy as np
import pytest
from clouds import error_of, motion

from idem_ros.core import InvalidConfig, InvalidTransform, PosePrior, solve_graph
from idem_ros.core.geometry import se3

SURE = np.diag([1e-4] * 3 + [1e-6] * 3)


def relation(i, j, T, covariance=SURE):
    return PosePrior(source=j, T=T, covariance=covariance, target=i)


def off_by(T, x):
    """A pose that is off by x y z rx ry rz, as covariances count it."""
    result = T.copy()
    result[:3, :3] = se3.exp(np.r_[x[3:], 0.0, 0.0, 0.0])[:3, :3] @ T[:3, :3]
    result[:3, 3] += x[:3]
    return result


def ring(rng, count):
    """True poses around a ring, and the steps between them, the last one back to the first."""
    turn = se3.exp(np.array([0.0, 0.0, 2 * np.pi / count, 1.0, 0.0, 0.1]))
    poses = [motion(rng, 40.0, 3.0)]
    for _ in range(count - 1):
        poses.append(poses[-1] @ turn)
    steps = [
        (k, (k + 1) % count, se3.inverse(poses[k]) @ poses[(k + 1) % count]) for k in range(count)
    ]
    return np.array(poses), steps


def test_relations_that_agree_are_met_from_far(rng):
    truth, steps = ring(rng, 12)
    starts = np.array([T if k == 0 else motion(rng, 20.0, 0.5) @ T for k, T in enumerate(truth)])
    found = solve_graph(starts, [relation(*step) for step in steps])
    assert found.converged
    np.testing.assert_allclose(found.poses, truth, atol=1e-7)
    assert found.misfits.max() < 1e-8
    np.testing.assert_array_equal(found.poses[0], truth[0])
    assert not found.covariances[0].any()


def test_a_loop_that_is_open_is_closed_by_what_is_least_sure(rng):
    truth, steps = ring(rng, 8)
    given = [relation(*step) for step in steps[:-1]]
    i, j, T = steps[2]
    given[2] = relation(i, j, off_by(T, np.r_[0.3, 0.0, 0.0, 0.0, 0.0, 0.0]), 1e4 * SURE)
    found = solve_graph(truth, [*given, relation(*steps[-1])])
    for T, true in zip(found.poses, truth, strict=True):
        degrees, distance = error_of(T, true)
        assert degrees < 0.01
        assert distance < 0.001


def test_deviations_are_those_that_many_graphs_show(rng):
    truth, steps = ring(rng, 6)
    root = np.linalg.cholesky(SURE)
    off = []
    for _ in range(300):
        given = [relation(i, j, off_by(T, root @ rng.normal(size=6))) for i, j, T in steps]
        found = solve_graph(truth, given)
        off.append(found.poses[3, :3, 3] - truth[3, :3, 3])
    promised = np.sqrt(np.diag(found.covariances[3])[:3])
    np.testing.assert_allclose(np.std(off, axis=0), promised, rtol=0.15)


def test_an_absolute_relation_holds_what_nothing_else_does(rng):
    truth, steps = ring(rng, 4)
    anchor = PosePrior(source=2, T=truth[2], covariance=SURE)
    starts = motion(rng, 5.0, 0.2) @ truth
    found = solve_graph(starts, [anchor, *(relation(*step) for step in steps)], held=())
    np.testing.assert_allclose(found.poses, truth, atol=1e-7)
    np.testing.assert_allclose(found.covariances[2], SURE, rtol=1e-6, atol=1e-12)


def test_poses_that_are_all_held_stay(rng):
    truth, steps = ring(rng, 2)
    found = solve_graph(truth, [relation(*step) for step in steps], held=(0, 1))
    np.testing.assert_array_equal(found.poses, truth)


def test_a_relation_of_a_pose_that_there_is_not_is_refused(rng):
    truth, _ = ring(rng, 3)
    with pytest.raises(InvalidConfig, match='names cloud 3; there are 3'):
        solve_graph(truth, [relation(0, 3, np.eye(4))])


def test_poses_that_nothing_holds_are_refused(rng):
    truth, steps = ring(rng, 6)
    given = [relation(*step) for step in (*steps[:2], *steps[3:5])]
    with pytest.raises(InvalidConfig, match='from pose 3 to one that is held'):
        solve_graph(truth, given)
    assert solve_graph(truth, given, held=(0, 5)).converged


@pytest.mark.parametrize(('poses', 'words'), [(5, 'must be'), ([np.ones((4, 4))], 'pose 0')])
def test_poses_that_are_none_are_refused(poses, words):
    with pytest.raises(InvalidTransform, match=words):
        solve_graph(poses, [])
