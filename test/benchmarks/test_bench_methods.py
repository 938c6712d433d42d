import sys

import numpy as np
import pytest
from clouds import surface

from benchmarks.case import LEVELS, Case, errors, starts, succeeded
from benchmarks.methods import PEERS, Setting, idem_solver, peer_solvers, settings
from idem_ros.core import RegistrationConfig
from idem_ros.replay.peers import PeersMissing, small_gicp


def bunny_sized(rng, size, voxel_size=None):
    clouds = [size * surface(rng, 2000) for _ in range(2)]
    return Case('bunny-sized', *clouds, np.eye(4), voxel_size)


@pytest.mark.parametrize('size', [0.05, 50.0])
def test_every_method_finds_the_truth_at_every_scale(rng, size):
    pytest.importorskip('small_gicp')
    case = bunny_sized(rng, size)
    solvers = [(Setting('IDEM'), idem_solver(case, RegistrationConfig()))]
    solvers += peer_solvers(case, settings((3.0,), (1.5,)))
    assert [setting.method for setting, _ in solvers] == ['IDEM', *PEERS]
    for setting, solve in solvers:
        T, _ = solve(starts(case, LEVELS[0], 1)[0])
        assert succeeded(case, *errors(case, T)), setting


def test_the_peers_reduce_to_the_voxels_of_the_case(rng):
    gicp = pytest.importorskip('small_gicp')
    case = bunny_sized(rng, 1.0, voxel_size=0.1)
    (_, solve), *_ = peer_solvers(case, [Setting('GICP', 3.0)])
    T, converged = solve(starts(case, LEVELS[0], 1)[0])
    assert converged
    scaled = [points / case.spacing for points in (case.target, case.source)]
    guess = starts(case, LEVELS[0], 1)[0]
    guess[:3, 3] /= case.spacing
    other = gicp.align(
        *scaled,
        guess,
        downsampling_resolution=0.1 / case.spacing,
        max_correspondence_distance=3.0,
        max_iterations=100,
        rotation_epsilon=1e-5,
        translation_epsilon=1e-4,
    ).T_target_source
    assert T[:3, 3] / case.spacing == pytest.approx(other[:3, 3], abs=0.02)


def test_every_peer_has_several_settings_to_choose_from():
    tried = settings()
    for method in PEERS:
        assert len({setting for setting in tried if setting.method == method}) >= 4


def test_what_is_missing_is_said_with_what_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'small_gicp', None)
    with pytest.raises(PeersMissing, match=r'\.\[bench\]'):
        small_gicp()
