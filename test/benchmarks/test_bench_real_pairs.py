import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks.real_pairs import real_case, real_pairs
from idem_ros.core.geometry import se3


def test_the_trusted_pairs_are_there_at_every_voxel_size(shared_data):
    names = [name for name, _ in real_pairs()]
    assert len(names) == len(set(names)) == 5 * 3 + 3 * 2 + 2 + 1
    assert {'bunny 000-315 1 mm', 'KITTI 0-2 500 mm', 'small_gicp 250 mm'} <= set(names)


@pytest.mark.parametrize('name', ['bunny 000-045 4 mm', 'KITTI 1-2 500 mm', 'dragon 2 mm'])
def test_the_truth_lays_the_source_on_the_target(shared_data, name):
    case = real_case(name, *dict(real_pairs())[name])
    source = se3.transform_points(case.truth, case.source[::50])
    distance, _ = cKDTree(case.target).query(source)
    assert np.median(distance) < 0.2 * case.voxel_size


def test_only_an_exact_truth_has_no_uncertainty(shared_data):
    pairs = dict(real_pairs())
    for name in ('bunny 000-045 4 mm', 'KITTI 0-1 500 mm', 'small_gicp 500 mm', 'dragon 2 mm'):
        case = real_case(name, *pairs[name])
        exact = name.startswith('dragon')
        assert (case.truth_rotation_deg == 0.0) == (case.truth_translation_m == 0.0) == exact


def test_without_the_folder_there_are_no_pairs(monkeypatch, tmp_path):
    monkeypatch.setattr('benchmarks.real_pairs.SHARED', tmp_path)
    assert real_pairs() == []
