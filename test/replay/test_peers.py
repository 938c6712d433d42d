import sys
from dataclasses import replace

import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.core import Cloud, RegistrationConfig, Status, register
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.replay.peers import Peer, PeersMissing
from idem_ros.replay.settings import METHODS

PEERS = METHODS[1:]
CONFIG = RegistrationConfig(voxel_size=0.08)


@pytest.fixture
def pair(rng):
    pytest.importorskip('small_gicp')
    truth = motion(rng, 20.0, 0.5)
    source = transform_points(inverse(truth), surface(rng, 3000))
    return Cloud(surface(rng, 3000)), Cloud(source), motion(rng, 2.0, 0.05) @ truth, truth


@pytest.mark.parametrize('method', PEERS)
@pytest.mark.parametrize('voxel_size', [None, 0.08])
def test_a_peer_finds_the_truth_in_the_place_of_idem(pair, method, voxel_size):
    target, source, guess, truth = pair
    config = RegistrationConfig(voxel_size=voxel_size)
    peer = Peer(method)
    result = peer.register(target, source, guess, config)
    degrees, distance = error_of(result.T_target_source, truth)
    before = error_of(guess, truth)
    assert degrees < 0.5 * before[0]
    assert distance < 0.5 * before[1]
    assert result.status is Status.CONVERGED
    assert result.iterations > 0


@pytest.mark.parametrize('method', PEERS)
def test_it_finds_the_same_at_map_coordinates_and_at_every_scale(pair, method):
    target, source, guess, _ = pair
    far, scale = np.eye(4), 64.0
    far[:3, 3] = 4e5, -5e6, 300.0
    moved = Cloud(scale * transform_points(far, target.points + target.origin))
    larger = Cloud(scale * (source.points + source.origin))
    T_moved = far @ guess
    T_moved[:3, 3] *= scale
    expected = far @ Peer(method).register(target, source, guess, CONFIG).T_target_source
    config = RegistrationConfig(voxel_size=scale * CONFIG.voxel_size)
    found = Peer(method).register(moved, larger, T_moved, config).T_target_source
    np.testing.assert_allclose(found[:3, :3], expected[:3, :3], atol=0.01)
    np.testing.assert_allclose(found[:3, 3] / scale, expected[:3, 3], atol=0.02)


def test_the_metric_judges_a_peer_by_the_very_figures_of_idem(pair):
    target, source, guess, _ = pair
    expected = register(target, source, guess, CONFIG)
    peer = Peer('gicp')
    found = peer.register(target, source, guess, CONFIG)
    assert np.isnan([found.q_tot, found.q_mean, found.overlap, found.radius]).all()
    at_idems = peer.judged(expected, target, source, CONFIG)
    for figure in ('q_tot', 'q_mean', 'overlap'):
        assert getattr(at_idems, figure) == pytest.approx(getattr(expected, figure), rel=1e-9)
    assert at_idems.radius == expected.radius
    judged = peer.judged(found, target, source, CONFIG)
    assert judged.radius == expected.radius
    at_guess = peer.judged(replace(found, T_target_source=guess), target, source, CONFIG)
    assert judged.q_tot < at_guess.q_tot


def test_a_target_is_prepared_once_and_another_again(pair, monkeypatch):
    target, source, guess, _ = pair
    peer, prepared = Peer('gicp'), []
    original = peer._prepared
    monkeypatch.setattr(
        peer, '_prepared', lambda cloud, unit: prepared.append(cloud) or original(cloud, unit)
    )
    for _ in range(2):
        peer.register(target, source, guess, CONFIG)
    assert len(prepared) == 3
    again = peer.register(source, target, inverse(guess), CONFIG)
    assert len(prepared) == 5
    expected = Peer('gicp').register(source, target, inverse(guess), CONFIG)
    np.testing.assert_array_equal(again.T_target_source, expected.T_target_source)


def test_max_distance_bounds_what_a_peer_matches(pair):
    target, source, guess, _ = pair
    for method in PEERS:
        far = guess.copy()
        far[:3, 3] += 50.0
        result = Peer(method, 0.2).register(target, source, far, CONFIG)
        assert result.status is Status.NO_OVERLAP
        np.testing.assert_array_equal(result.T_target_source, far)
        assert Peer(method).judged(result, target, source, CONFIG).overlap == 0.0
        other = Peer(method, 0.06).register(target, source, guess, CONFIG)
        default = Peer(method).register(target, source, guess, CONFIG)
        assert (other.T_target_source != default.T_target_source).any()


def test_clouds_without_a_spacing_are_a_status(pair):
    target, source, guess, _ = pair
    few, same = Cloud(np.eye(3)), Cloud(np.ones((20, 3)))
    config = RegistrationConfig()
    peer = Peer('icp')
    for clouds, status in (((target, few), 'too_few_points'), ((same, source), 'degenerate')):
        result = peer.register(*clouds, guess, config)
        assert result.status is Status(status)
        assert peer.judged(result, *clouds, config).q_tot == 0.0


def test_without_small_gicp_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, 'small_gicp', None)
    with pytest.raises(PeersMissing, match=r'\.\[bench\]'):
        Peer('gicp')
