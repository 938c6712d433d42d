import numpy as np
import pytest
from clouds import motion
from evo.core import metrics, sync
from evo.core.units import Unit
from evo.tools import file_interface
from trajectories import drive

from idem_ros.files.pose_file import write_tum
from idem_ros.files.trajectory_file import Trajectory, read_trajectory
from idem_ros.trajectory.errors import (
    IncomparableTrajectories,
    alignment,
    ape,
    associate,
    rpe,
    statistics,
)

SAME = {'rtol': 0, 'atol': 1e-6}
RELATIONS = {
    'translation_m': metrics.PoseRelation.translation_part,
    'rotation_deg': metrics.PoseRelation.rotation_angle_deg,
    'full': metrics.PoseRelation.full_transformation,
}
UNITS = {'m': Unit.meters, 'f': Unit.frames}


def some_of(trajectory, which):
    return Trajectory(trajectory.poses[which], trajectory.stamps[which])


def thinned(rng, trajectory, share):
    return some_of(trajectory, rng.random(len(trajectory)) < share)


@pytest.fixture(params=['estimate shorter', 'reference shorter', 'equally long'])
def both(request, rng, tmp_path):
    """Ours and evo's reading of the same two TUM files, associated."""
    reference, estimate = drive(rng, shake=15_000_000)  # beyond the tolerance of 10 ms
    if request.param == 'estimate shorter':
        estimate = thinned(rng, estimate, 0.7)
    if request.param == 'reference shorter':
        reference = thinned(rng, reference, 0.7)
    files = tmp_path / 'reference.tum', tmp_path / 'estimate.tum'
    for file, trajectory in zip(files, (reference, estimate), strict=True):
        write_tum(file, trajectory.stamps, trajectory.poses)
    ours = associate(*map(read_trajectory, files))
    theirs = sync.associate_trajectories(*map(file_interface.read_tum_trajectory_file, files))
    return ours, theirs


def assert_same(errors, metric, pair):
    for key, relation in RELATIONS.items():
        theirs = metric(relation)
        theirs.process_data(pair)
        np.testing.assert_allclose(getattr(errors, key), theirs.error, **SAME)
        expected = theirs.get_all_statistics()
        found = statistics(getattr(errors, key))
        assert found.keys() == expected.keys()
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-6)


def test_stamps_are_associated_as_evo_does(both):
    ours, theirs = both
    assert 20 < len(ours[0]) < 200
    for mine, its in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine.stamps / 1e9, its.timestamps, rtol=0, atol=1e-6)


def test_ape_is_that_of_evo(both):
    ours, theirs = both
    assert_same(ape(*ours), metrics.APE, theirs)


def test_ape_of_aligned_trajectories_is_that_of_evo(both):
    (reference, estimate), theirs = both
    before = ape(reference, estimate).translation_m
    estimate = Trajectory(alignment(reference, estimate) @ estimate.poses)
    theirs[1].align(theirs[0])
    errors = ape(reference, estimate)
    assert_same(errors, metrics.APE, theirs)
    assert statistics(errors.translation_m)['rmse'] < statistics(before)['rmse']


@pytest.mark.parametrize('all_pairs', [False, True])
@pytest.mark.parametrize(
    ('delta', 'unit'), [(1, 'f'), (7, 'f'), (1.0, 'm'), (2.5, 'm'), (20.0, 'm')]
)
def test_rpe_is_that_of_evo(both, delta, unit, all_pairs):
    ours, theirs = both

    def metric(relation):
        return metrics.RPE(relation, delta, UNITS[unit], all_pairs=all_pairs)

    errors = rpe(*ours, delta, unit, all_pairs)
    assert len(errors) >= 1
    assert_same(errors, metric, theirs)


def test_a_rigid_copy_is_aligned_to_nothing(rng):
    reference, _ = drive(rng)
    moved = Trajectory(motion(rng, 120.0, 1e3) @ reference.poses, reference.stamps)
    assert statistics(ape(reference, moved).translation_m)['rmse'] > 100
    aligned = Trajectory(alignment(reference, moved) @ moved.poses)
    assert ape(reference, aligned).translation_m.max() < 1e-9
    assert rpe(reference, moved, 1.0, 'm').full.max() < 1e-9


def test_of_two_equally_near_stamps_the_earlier_is_taken():
    poses = np.eye(4)[None].repeat(3, axis=0)
    long = Trajectory(poses, np.array([0, 10, 20]) * 10**6)
    short = Trajectory(poses[:1], np.array([15]) * 10**6)
    assert associate(long, short)[0].stamps.tolist() == [10**7]
    assert associate(short, long)[1].stamps.tolist() == [10**7]


def test_poses_without_stamps_belong_together_by_number(rng):
    reference, estimate = drive(rng, 5)
    numbered = Trajectory(reference.poses)
    assert associate(numbered, estimate) == (numbered, estimate)
    with pytest.raises(IncomparableTrajectories, match='has 5 poses and the estimate 3'):
        associate(numbered, some_of(estimate, slice(3)))


def test_stamps_of_another_time_are_refused_with_both_spans(rng):
    reference, estimate = drive(rng, 5)
    later = Trajectory(estimate.poses, estimate.stamps + 10**12)
    with pytest.raises(IncomparableTrajectories, match=r'1700001000.* and 1700000000\.000'):
        associate(reference, later)


def test_a_straight_path_is_not_aligned():
    poses = np.eye(4)[None].repeat(10, axis=0)
    poses[:, 0, 3] = np.arange(10)
    with pytest.raises(IncomparableTrajectories, match='on one line'):
        alignment(Trajectory(poses), Trajectory(poses))


def test_a_path_shorter_than_delta_has_no_pairs_and_no_statistics(rng):
    reference, estimate = drive(rng, 5)
    for all_pairs in (False, True):
        for delta, unit in ((100.0, 'm'), (10, 'f')):
            errors = rpe(reference, estimate, delta, unit, all_pairs)
            assert len(errors) == 0
            assert set(statistics(errors.translation_m).values()) == {None}
