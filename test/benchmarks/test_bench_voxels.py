import numpy as np

from benchmarks.case import Case
from benchmarks.voxel_sets import VoxelSet
from benchmarks.voxels import OfSize, SetResult, measure_voxels, voxels_table
from idem_ros.core import RegistrationConfig


def test_auto_is_measured_beside_every_fixed_size(rng):
    points = rng.random((5_000, 3))
    points[np.arange(5_000), rng.integers(0, 3, 5_000)] = 0.0
    case = Case('corner', points, points[::-1].copy(), np.eye(4), None, 0.1, 0.01)
    corner = VoxelSet('corner', lambda: iter([case, case]), (None, 0.1), (2.0, 0.01), (1.0, 0.1))
    (result,) = measure_voxels([corner], RegistrationConfig(), 1)
    assert list(result.of) == ['auto', None, 0.1]
    assert all(found.right == [True] for found in result.of.values())
    assert result.of[None].voxels == [None]
    assert result.of['auto'].voxels[0] > 0.0
    assert result.record()['sizes'].keys() == {'auto', 'given', '0.1'}
    assert 'corner' in voxels_table([result])


def of(right, error, ms):
    return OfSize(right, error, ms, right, [1.0] * len(right))


def test_the_best_fixed_size_is_right_most_often_and_then_most_exact():
    of_sizes = {
        'auto': of([True, True], [0.02, 0.02], [15.0, 15.0]),
        0.1: of([True, False], [0.001, 0.001], [1.0, 1.0]),
        0.2: of([True, True], [0.018, 0.018], [10.0, 10.0]),
        0.4: of([True, True], [0.03, 0.03], [5.0, 5.0]),
    }
    result = SetResult('made up', False, of_sizes, truth=0.0)
    assert result.best == 0.2
    assert np.allclose(result.ratios(), (0.02 / 0.018, 1.5))
    assert result.reached()
    of_sizes['auto'].right[0] = False
    assert not result.reached()


def test_errors_within_that_of_the_truth_count_alike():
    of_sizes = {'auto': of([True], [0.02], [1.0]), 0.1: of([True], [0.001], [1.0])}
    assert SetResult('made up', False, of_sizes, truth=0.05).ratios()[0] == 1.0
