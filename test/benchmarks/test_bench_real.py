import json
from dataclasses import replace

import numpy as np
import pytest
from clouds import motion
from scipy.spatial import cKDTree

from benchmarks.conditions import condition
from benchmarks.documentation import near_starts
from benchmarks.new_scans import ScanSet, scan_sets
from benchmarks.real import (
    METHODS,
    Figures,
    Key,
    best_of,
    better_peers,
    closures,
    measure_sets,
    real_markdown,
    real_record,
)
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3


def figures(rotation, translation, time=10.0, right=3):
    n = 3
    at = (translation,) * n
    return Figures((rotation,) * n, at, (time,) * n, (True,) * right + (False,) * (n - right), at)


def key(method, setting=''):
    return Key('ring', 'near', method, 500.0, setting)


PEERS = {key('VGICP'): figures(0.3, 9.0), key('PLANE_ICP'): figures(0.3, 9.0)}


def test_the_new_scans_are_there(shared_data):
    assert {scans.name: len(scans.pairs) for scans in scan_sets()} == {
        'dragon': 20,
        'KITTI 00': 15 + 14,
        '7-Scenes': 29 + 9,
    }


@pytest.mark.parametrize('number', range(3))
@pytest.mark.parametrize('pair', [0, -1])
def test_the_truth_of_new_scans_lays_the_source_on_the_target(shared_data, number, pair):
    scans = scan_sets()[number]
    _, build = scans.pairs[pair]
    case = build(scans.voxel_sizes[0])
    source = se3.transform_points(case.truth, case.source[::97])
    distance, _ = cKDTree(case.target).query(source)
    assert np.quantile(distance, 0.25) < scans.voxel_sizes[0]


def test_the_setting_with_fewest_failures_is_a_method_s_best():
    of = {
        key('GICP', 'a'): figures(0.1, 1.0, right=2),
        key('GICP', 'b'): figures(0.2, 2.0),
        key('GICP', 'c'): figures(0.3, 3.0),
    }
    assert best_of(of, 'ring', 'near', 'GICP').setting == 'b'


def test_what_a_peer_does_better_is_told_and_nothing_else():
    of = {key('IDEM'): figures(0.2, 5.0), key('GICP'): figures(0.1, 6.0, time=20.0), **PEERS}
    lines = better_peers(of)
    assert [line.partition(' 0.1')[0] for line in lines] == [
        'ring, near: median of the rotation',
        'ring, near: p90 of the rotation',
    ]
    assert all('GICP' in line and '0.2 deg' in line for line in lines)


def test_more_right_and_less_time_of_a_peer_are_told():
    of = {key('IDEM'): figures(0.1, 5.0, right=2), key('GICP'): figures(0.2, 6.0, 4.0), **PEERS}
    assert better_peers(of) == [
        'ring, near: right 3 (GICP), 2; by chance p 1.00',
        'ring, near: time 4 ms (GICP), 10 ms',
    ]


@pytest.mark.parametrize(('ours', 'is_beyond'), [(9, False), (0, True)])
def test_only_a_count_that_chance_does_not_explain_is_told_in_the_readme(
    tmp_path, ours, is_beyond
):
    def of(method, right):
        at = (1.0,) * 10
        return key(method), Figures(at, at, at, (True,) * right + (False,) * (10 - right), at)

    scans = ScanSet('ring', (), (), {}, (1.0, 1.0), (0.15, 0.4), 1e-3)
    measured = dict([of('IDEM', ours), *(of(method, 10) for method in METHODS[1:])])
    (tmp_path / 'bench_real.md').write_text(real_markdown(measured, [scans]))
    told = near_starts(tmp_path / 'bench_real.md')
    assert 'Of 1 figures' in told
    assert ('right 10' in told) == is_beyond


def test_every_voxel_size_of_idem_and_the_best_of_each_peer_are_in_the_table():
    of = {
        key('IDEM'): figures(0.1, 5.0),
        key('IDEM')._replace(voxel_mm=250.0): figures(0.3, 7.0),
        key('GICP', 'distance 3'): figures(0.2, 6.0, time=20.0),
        key('GICP', 'distance 1'): figures(0.2, 9.0, time=20.0),
        **PEERS,
    }
    scans = ScanSet('ring', (), (), {}, (1.0, 1.0), (0.15, 0.4), 1e-3)
    text = real_markdown(of, [scans])
    assert 'ring: 0.15 deg and 0.4 mm' in text
    assert [text.count(f'| {method} ') for method in ('IDEM', 'GICP', 'VGICP')] == [2, 1, 1]
    assert 'distance 3' in text
    assert 'Nothing.' in text
    assert len(json.loads(json.dumps(real_record(of)))['figures']) == len(of)


def test_a_triangle_of_scans_is_closed_without_a_truth(rng):
    T_ab, T_bc, error = motion(rng, 50, 2.0), motion(rng, 80, 1.0), motion(rng, 0.3, 0.01)
    pairs = ('a', 'b'), ('b', 'c'), ('a', 'c'), ('c', 'd')
    transforms = [T.tolist() for T in (T_ab, T_bc, error @ T_ab @ T_bc, error)]
    of = figures(0.1, 1.0)
    ((degrees, length),) = closures(replace(of, pairs=pairs, transforms=tuple(transforms)))
    assert degrees == pytest.approx(0.3)
    assert length == pytest.approx(0.01)


def test_all_methods_are_measured_on_every_pair():
    pytest.importorskip('small_gicp')

    def build(voxel_size):
        case = condition('similar', 1)
        return type(case)('pair', case.target[::4], case.source[::2], case.truth, voxel_size)

    scans = ScanSet(
        'body', ((('a', 'b'), build),), (0.008,), {'near': (1.0, 0.002)}, (5.0, 0.01), (0.0, 0.0)
    )
    of = measure_sets([scans], RegistrationConfig(assessment='none'))
    assert {each.method for each in of} == {'IDEM', 'GICP', 'VGICP', 'PLANE_ICP'}
    (idem,) = (one for each, one in of.items() if each.method == 'IDEM')
    assert idem.right == (True,)
    assert idem.time[0] > 0.0
    assert idem.rotation[0] < 2.0
