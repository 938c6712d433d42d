import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks.lidar_cases import scan_to_map, scan_to_scan
from idem_ros.core.geometry import se3
from idem_ros.simulation.lidar import Lidar

COARSE = Lidar(rings=16, azimuth_steps=180)


@pytest.mark.parametrize('kind', ['street', 'room', 'forest'])
@pytest.mark.parametrize('build', [scan_to_scan, scan_to_map])
def test_the_truth_lays_the_scan_on_the_target(kind, build):
    case = build('some', kind, 0, 0.5, COARSE)
    source = se3.transform_points(case.truth, case.source)
    right, _ = cKDTree(case.target).query(source)
    wrong, _ = cKDTree(case.target).query(source + (0.5, 0.5, 0.3))
    assert np.median(right) < 0.7 * np.median(wrong)
    assert not np.allclose(case.truth, np.eye(4))


def test_a_map_holds_more_than_a_scan_but_not_the_scan_itself():
    scan, mapped = (
        build('some', 'street', 0, 0.5, COARSE) for build in (scan_to_scan, scan_to_map)
    )
    assert len(mapped.target) > 4 * len(scan.target)
    source = se3.transform_points(mapped.truth, mapped.source)
    distance, _ = cKDTree(mapped.target).query(source)
    assert distance.min() > 0.0


def test_the_same_seed_gives_the_same_case_and_another_seed_another_scene():
    first, again, other = (scan_to_scan('some', 'street', s, 0.5, COARSE) for s in (1, 1, 2))
    assert np.array_equal(first.source, again.source)
    assert not np.allclose(first.truth, other.truth)
