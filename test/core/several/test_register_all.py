import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    InvalidConfig,
    InvalidTransform,
    PosePrior,
    RegistrationConfig,
    Status,
    Verdict,
    register,
    register_all,
)
from idem_ros.core.geometry import se3

QUIET = RegistrationConfig(assessment='none', voxel_size=None)


@pytest.fixture
def ring(rng):
    """Five scans around a body, each of half of it; their true poses, and starts off these."""
    body, scans, truth = surface(rng, 9000), [], []
    for k in range(5):
        angle = 2 * np.pi * k / 5
        seen = body @ (np.cos(angle), np.sin(angle), 0.0) > 0.05
        points = body[seen][rng.random(seen.sum()) < 0.5]
        pose = motion(rng, 40, 0.5)
        points = points + rng.normal(0, 0.003, points.shape)
        scans.append(se3.transform_points(se3.inverse(pose), points))
        truth.append(pose)
    starts = [T @ motion(rng, 2, 0.02) for T in truth]
    starts[0] = truth[0]
    return scans, np.array(truth), np.array(starts)


def worst(poses, truth):
    errors = [error_of(a, b) for a, b in zip(poses, truth, strict=True)]
    return np.max(errors, axis=0)


def test_a_ring_of_scans_is_registered_at_once(ring):
    scans, truth, starts = ring
    result = register_all(scans, starts, RegistrationConfig(voxel_size=None))
    assert result.converged
    assert result.is_usable
    degrees, distance = worst(result.poses, truth)
    assert degrees < 0.2
    assert distance < 0.003
    np.testing.assert_array_equal(result.poses[0], truth[0])
    assert result.parts == ((0, 1, 2, 3, 4),)
    assert {said.verdict for said in result.verdicts} == {Verdict.ALIGNED}
    neighbours = [edge for edge in result.edges if edge.j - edge.i in (1, 4)]
    assert len(neighbours) == 5
    assert all(edge.overlap > 0.3 for edge in neighbours)


def test_errors_are_as_large_as_their_covariance_says(ring):
    scans, truth, starts = ring
    result = register_all(scans, starts, RegistrationConfig(voxel_size=None))
    assert not result.covariance[:6].any()
    squares = []
    for k in range(1, 5):
        off = result.poses[k] @ se3.inverse(truth[k])
        error = np.r_[result.poses[k, :3, 3] - truth[k, :3, 3], se3.log(off)[:3]]
        block = result.covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
        squares.append(error @ np.linalg.solve(block, error) / 6)
    assert 0.1 < np.mean(squares) < 5


@pytest.mark.parametrize('seed', range(3))
def test_any_order_of_the_clouds_gives_the_same_poses(ring, seed):
    scans, _, starts = ring
    order = np.random.default_rng(seed).permutation(5)
    first = register_all(scans, starts, QUIET)
    held = [int(np.flatnonzero(order == 0)[0])]
    other = register_all([scans[k] for k in order], starts[order], QUIET, held=held)
    np.testing.assert_allclose(other.poses, first.poses[order], atol=1e-12)
    assert other.q_tot == pytest.approx(first.q_tot, rel=1e-12)


def test_which_cloud_is_held_changes_the_frame_alone(ring):
    scans, _, starts = ring
    first, other = (register_all(scans, starts, QUIET, held=[k]) for k in (0, 3))
    np.testing.assert_array_equal(other.poses[3], starts[3])
    moved = first.poses[3] @ se3.inverse(other.poses[3])
    np.testing.assert_allclose(moved @ other.poses, first.poses, atol=1e-9)


def test_a_common_motion_of_all_starts_moves_all_poses(ring, rng):
    scans, _, starts = ring
    common = motion(rng, 70, 30.0)
    first, other = (register_all(scans, poses, QUIET) for poses in (starts, common @ starts))
    np.testing.assert_allclose(other.poses, common @ first.poses, atol=1e-4)


@pytest.mark.parametrize('held', [0, 1])
def test_two_clouds_are_registered_as_register_does(ring, held):
    scans, _, starts = ring
    result = register_all(scans[:2], starts[:2], held=[held])
    target, source = held, 1 - held
    T = se3.inverse(starts[target]) @ starts[source]
    pair = register(scans[target], scans[source], T)
    relative = se3.inverse(result.poses[target]) @ result.poses[source]
    np.testing.assert_allclose(relative, pair.T_target_source, atol=1e-9)
    assert result.q_tot == pytest.approx(pair.q_tot, rel=1e-9)
    assert result.verdicts[source].verdict is pair.assessment.verdict


def test_held_clouds_stay(ring):
    scans, truth, starts = ring
    starts = starts.copy()
    starts[[0, 2]] = truth[[0, 2]]
    result = register_all(scans, starts, QUIET, held=[0, 2])
    assert result.held == (0, 2)
    np.testing.assert_array_equal(result.poses[[0, 2]], truth[[0, 2]])
    assert worst(result.poses, truth)[0] < 0.2


def test_where_all_are_held_nothing_moves_and_all_is_judged(ring):
    scans, truth, _ = ring
    result = register_all(scans, truth, RegistrationConfig(voxel_size=None), held=range(5))
    np.testing.assert_array_equal(result.poses, truth)
    assert result.is_usable
    assert not result.covariance.any()


def test_clouds_that_do_not_hang_together_are_named_and_each_part_solved(ring):
    scans, truth, starts = ring
    far = se3.translation(np.array([50.0, 0.0, 0.0]))
    both = register_all(scans * 2, np.concatenate([starts, far @ starts]), QUIET)
    assert both.parts == ((0, 1, 2, 3, 4), (5, 6, 7, 8, 9))
    assert both.held == (0, 5)
    assert not both.is_usable
    assert worst(both.poses[:5], truth)[0] < 0.2
    shift = both.poses[5] @ se3.inverse(truth[0])
    assert worst(both.poses[5:], shift @ truth)[0] < 0.2


def test_a_cloud_that_meets_nothing_is_told_and_stays(ring):
    scans, truth, starts = ring
    starts = starts.copy()
    starts[2] = se3.translation(np.array([50.0, 0.0, 0.0])) @ starts[2]
    result = register_all(scans, starts, RegistrationConfig(voxel_size=None))
    assert result.verdicts[2].verdict is Verdict.SEPARATED
    np.testing.assert_array_equal(result.poses[2], starts[2])
    kept = [0, 1, 3, 4]
    assert worst(result.poses[kept], truth[kept])[0] < 0.2
    assert [result.usable[k] for k in kept] == [True] * 4
    assert not result.is_usable


def test_a_cloud_in_another_unit_is_asked_for_its_unit(ring):
    scans, _, starts = ring
    scans = [*scans[:4], 1000 * scans[4]]
    starts = starts.copy()
    starts[4, :3, 3] *= 1000
    said = register_all(scans, starts, RegistrationConfig(voxel_size=None)).verdicts[4]
    assert said.verdict is not Verdict.ALIGNED
    assert 'unit' in said.reason


def test_a_misplaced_cloud_alone_is_misaligned(ring):
    scans, truth, _ = ring
    poses = truth.copy()
    poses[3] = truth[3] @ motion(np.random.default_rng(1), 6, 0.06)
    result = register_all(scans, poses, RegistrationConfig(voxel_size=None, mode='audit'))
    np.testing.assert_allclose(result.poses, poses, atol=1e-12)
    assert result.status is Status.AUDITED
    assert result.usable == (True, True, True, False, True)


def test_a_prior_holds_a_cloud_that_the_points_leave_open(rng):
    plane = np.c_[rng.uniform(-1, 1, (2000, 2)), rng.normal(0, 0.002, 2000)]
    clouds = [plane[k::3] for k in range(3)]
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[1, :3, 3] = 0.05, 0.0, 0.01
    tight = np.diag([1e-8] * 6)
    wanted = se3.translation(np.array([0.02, 0.0, 0.0]))
    prior = PosePrior(source=1, target=0, T=wanted, covariance=tight)
    result = register_all(clouds, poses, QUIET, priors=[prior])
    assert result.poses[1, 0, 3] == pytest.approx(0.02, abs=1e-3)
    assert abs(result.poses[1, 2, 3]) < 2e-3


def test_a_loose_prior_changes_little(ring):
    scans, truth, starts = ring
    wrong = truth[2] @ motion(np.random.default_rng(2), 5, 0.1)
    prior = PosePrior(source=2, T=wrong, covariance=np.diag([1.0] * 6))
    result = register_all(scans, starts, QUIET, held=[0], priors=[prior])
    assert worst(result.poses, truth)[0] < 0.3


@pytest.mark.parametrize('budget_ms', [1e-6, 0.1, 1.0, 4.0, 16.0])
def test_nothing_of_the_budget_left_is_said(ring, budget_ms):
    scans, _, starts = ring
    config = RegistrationConfig(voxel_size=None, budget_ms=budget_ms)
    result = register_all(scans, starts, config)
    assert result.status is Status.LATE or budget_ms > 1.0
    assert result.status is not Status.LATE or not result.is_usable


def test_a_cloud_of_few_points_is_left_out_and_told(ring):
    scans, truth, starts = ring
    result = register_all([*scans, scans[0][:3]], np.concatenate([starts, starts[:1]]))
    assert result.verdicts[5].verdict is Verdict.NOT_CONVERGED
    assert '3 points' in result.verdicts[5].reason
    assert worst(result.poses[:5], truth)[0] < 0.3


@pytest.mark.parametrize(
    ('change', 'error', 'words'),
    [
        (lambda c, p: (c[:1], p[:1]), InvalidCloud, 'two at least'),
        (lambda c, p: ([], p[:0]), InvalidCloud, 'two at least'),
        (lambda c, p: (c[0], p), InvalidCloud, 'one cloud'),
        (lambda c, p: (c, p[:3]), InvalidTransform, '3 poses were given for 5 clouds'),
        (lambda c, p: ([*c[:4], c[4][:, :2]], p), InvalidCloud, 'cloud 4'),
        (lambda c, p: (c, [*p[:4], 2 * p[4]]), InvalidTransform, 'the pose of cloud 4'),
    ],
)
def test_what_is_no_problem_is_refused(ring, change, error, words):
    scans, _, starts = ring
    with pytest.raises(error, match=words):
        register_all(*change(scans, starts))


def test_priors_and_held_clouds_that_there_are_not_are_refused(ring):
    scans, _, starts = ring
    with pytest.raises(InvalidConfig, match='cloud 7'):
        register_all(scans, starts, held=[7])
    prior = PosePrior(source=9, T=np.eye(4), covariance=np.eye(6))
    with pytest.raises(InvalidConfig, match='cloud 9'):
        register_all(scans, starts, priors=[prior])
    with pytest.raises(InvalidConfig, match='symmetric'):
        PosePrior(source=1, T=np.eye(4), covariance=-np.eye(6))


def test_more_points_than_memory_bounds_are_refused(rng):
    cloud = Cloud(rng.random((50_000, 3)))
    with pytest.raises(InvalidConfig, match='larger voxel_size'):
        register_all([cloud] * 100, config=QUIET)


def test_any_number_of_threads_gives_the_same_result(ring):
    scans, _, starts = ring
    one, three = (
        register_all(scans, starts, RegistrationConfig(voxel_size=None, threads=threads))
        for threads in (1, 3)
    )
    np.testing.assert_array_equal(three.poses, one.poses)
    np.testing.assert_array_equal(three.covariance, one.covariance)
    assert three.q_tot == one.q_tot
    assert [edge.p_aligned for edge in three.edges] == [edge.p_aligned for edge in one.edges]


def test_the_gap_of_an_edge_is_how_far_the_two_alone_would_have_the_second_cloud(ring):
    scans, truth, _ = ring
    poses = truth.copy()
    poses[3, 2, 3] += 0.004
    config = RegistrationConfig(voxel_size=None, mode='audit')
    edges = register_all(scans, poses, config).edges
    (edge,) = (edge for edge in edges if (edge.i, edge.j) == (2, 3))
    found = truth[2, :3, :3] @ edge.gap[:3]  # about the origin of cloud 3, in common axes
    middle = truth[3, :3, :3] @ scans[3].mean(axis=0)
    found += np.cross(truth[2, :3, :3] @ edge.gap[3:], middle)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.004], atol=0.002)


@pytest.mark.parametrize('assessment', ['none', 'verdict'])
def test_clouds_of_which_none_meets_another_stay_as_priors_have_them(rng, assessment):
    clouds = [surface(rng, 500) for _ in range(3)]
    poses = np.array([se3.translation(np.array([50.0 * k, 0.0, 0.0])) for k in range(3)])
    step = se3.translation(np.array([50.0, 0.0, 0.0]))
    priors = [PosePrior(k + 1, step, 1e-4 * np.eye(6), target=k) for k in range(2)]
    config = RegistrationConfig(voxel_size=0.1, assessment=assessment)
    found = register_all(clouds, poses, config, held=(0,), priors=priors)
    assert found.status is Status.NO_OVERLAP
    np.testing.assert_allclose(found.poses, poses, atol=1e-6)
    assert len(found.parts) == 3
