"""Targets that are maps: from a file, and in parts."""

import numpy as np
import pytest
from pairs import cloud
from poses import SECOND

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.maps.open_map import MapPoints
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import MapConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.pairing.targets import PairingConfig

PARTS = MapConfig(target_mode='accumulate')
EVERYWHERE = (-1e4, -1e4, -1e4), (1e4, 1e4, 1e4)


def pairing_of(map_config=None, rule='latched'):
    return Pairing(PairingConfig(rule), GuessConfig('identity'), map_config)


@pytest.fixture
def map_(rng):
    return MapPoints(rng.uniform(-10, 10, (1000, 3)), 'a map')


@pytest.mark.parametrize('rule', ['latched', 'newest', 'nearest'])
def test_a_map_from_a_file_is_the_target_of_every_source_whatever_its_stamp(map_, rule):
    pairing = pairing_of(MapConfig(target_frame='world'), rule)
    assert pairing.add_source(cloud(7, 'lidar')) == []
    (pair,) = pairing.add_map(map_)
    for stamp in (0, 9 * SECOND, 1, 10**18):  # the clock goes back, too
        pairs = [pair, *pairing.add_source(cloud(stamp, 'lidar'))]
        assert [each.target.map for each in pairs] == [map_] * len(pairs)
        assert {each.target.header.frame_id for each in pairs} == {'world'}
    assert pairing.refused_targets == 0


def test_a_map_takes_the_place_of_the_one_before(map_, rng):
    pairing = pairing_of()
    pairing.add_map(map_)
    other = MapPoints(rng.uniform(-10, 10, (1000, 3)), 'another')
    pairing.add_map(other)
    (pair,) = pairing.add_source(cloud(7, 'lidar'))
    assert pair.target.map is other


def test_parts_of_one_frame_are_one_target(rng):
    pairing = pairing_of(PARTS)
    parts = [rng.uniform((10 * i, 0, 0), (10 * i + 10, 10, 4), (500, 3)) for i in range(3)]
    for i, points in enumerate(parts):
        pairing.add_target(cloud(i + 1, 'map', points))
        (pair,) = pairing.add_source(cloud(100 + i, 'lidar'))
        assert pair.target.header.stamp.nanosec == i + 1
        assert pair.target.map.bounds[1, 0] == pytest.approx(10 * i + 10, abs=0.5)
    pairing.add_target(cloud(9, 'odom', parts[0] + 100.0))
    (pair,) = pairing.add_source(cloud(200, 'lidar'))
    assert pair.target.map.bounds[0].min() > 99.0


def test_a_part_that_cannot_be_used_is_refused_and_the_map_stays():
    pairing = pairing_of(PARTS)
    pairing.add_target(cloud(1, 'map'))
    pairing.add_target(cloud(2, 'map', np.full((10, 3), np.nan)))
    (pair,) = pairing.add_source(cloud(100, 'lidar'))
    assert len(pair.target.map) == 10
    assert pairing.refused_targets == 1


def test_large_targets_are_kept_two_at_a_time(monkeypatch):
    monkeypatch.setattr('idem_ros.pairing.targets.MOST_BYTES', 300)
    pairing = pairing_of()
    for stamp in range(1, 6):  # of 120 bytes each
        pairing.add_target(cloud(stamp, 'map'))
    assert pairing.add_source(cloud(3, 'lidar'))[0].target.header.stamp.nanosec == 5
    assert pairing.add_source(cloud(4, 'lidar'))[0].target.header.stamp.nanosec == 4


@pytest.mark.parametrize(
    ('given', 'says'),
    [
        ({'target_file': 'map.pcd', 'target_frame': ''}, 'target_frame is'),
        ({'target_file': 'map.pcd', 'target_frame': 'the map'}, 'name of the frame'),
        ({'target_file': 'map.pcd', 'target_mode': 'accumulate'}, 'choose one'),
        ({'target_file': 7}, 'must be a text'),
        ({'target_mode': 'add'}, 'one of'),
        ({'target_radius': 0.0}, 'above 0'),
        ({'target_voxel_size': -1.0}, 'above 0'),
    ],
)
def test_a_configuration_that_contradicts_itself_is_refused(given, says):
    with pytest.raises(InvalidConfig, match=says):
        MapConfig(**given)
