"""A town as a map on disk and a drive through it."""

import json
from pathlib import Path

import numpy as np
import pytest

from idem_ros.commands.main import main
from idem_ros.maps.open_map import open_map
from idem_ros.simulation.drive import drive
from idem_ros.simulation.street import LANE
from idem_ros.simulation.surfaces import Scene
from idem_ros.simulation.town import BLOCK, CELLS_KEPT, Town


@pytest.fixture(scope='module')
def town():
    return Town(4, 6)


def test_a_cell_is_the_same_whenever_it_is_made(town):
    other = Town(4, 6)
    for i in range(6):
        other.near((BLOCK * i, BLOCK * 5), 10.0)
    for kind in ('triangles', 'boxes', 'cylinders', 'spheres'):
        one, again = (getattr(each.near((200, 200), 50.0), kind) for each in (town, other))
        np.testing.assert_array_equal(one, again)


def test_a_town_of_many_cells_keeps_a_few():
    large, places = Town(0, 300), range(8, 8 + 4 * CELLS_KEPT // 3, 4)  # of four cells each
    for i in places:
        large.near((BLOCK * i, BLOCK * i), 10.0)
    assert 4 * len(places) > CELLS_KEPT
    assert len(large._cells) <= CELLS_KEPT


def test_streets_meet_without_a_step(town):
    for along_x in (0, 1):
        here, there = town.street(2, 3, along_x), town.street(2 + along_x, 4 - along_x, along_x)
        assert np.linalg.norm(there[0] - here[-1]) < 0.6


def test_a_drive_keeps_to_the_streets_and_is_as_long_as_asked_for(town):
    route = town.route(900.0, np.random.default_rng(1))
    steps = np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1)
    assert steps.max() < 0.6
    assert 880.0 < steps.sum() < 910.0
    poses = drive(Scene(route=route), 50, np.random.default_rng(2), lateral_m=LANE)
    off = np.abs(poses[:, :2, 3] / BLOCK - np.round(poses[:, :2, 3] / BLOCK)).min(axis=1) * BLOCK
    assert off.max() < 5.2  # of the middle of a street: half its width
    assert (poses[:, :2, 3] > BLOCK / 2).all()
    assert (poses[:, :2, 3] < town.extent - BLOCK / 2).all()


def test_scans_of_the_drive_are_found_in_the_map(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert (
        main(['simulate', '--map', 'city', '--extent', '270', '--scans', '3', '--out', 'c']) == 0
    )
    said = capsys.readouterr().out
    points = int(said.split('town of ')[1].split()[0])
    opened = open_map('c/map')
    assert len(opened.points_within(*opened.bounds)) == points > 100_000
    argv = ['replay', 'c/drive.mcap', '--target-file', 'c/map', '--voxel-size', '0.5']
    assert main([*argv, '--json', 'r.json']) == 0
    frames = json.loads(Path('r.json').read_text())['frames']
    assert [frame['verdict'] for frame in frames] == ['aligned'] * 3
    assert max(frame['translation_error_m'] for frame in frames) < 0.03


@pytest.mark.parametrize(
    'options',
    [
        ['--map', 'city', '--extent', '0'],
        ['--map', 'city', '--extent', '10'],
        ['--map', 'city', '--extent', '1e9'],
        ['--map', 'city', '--scene', 'room'],
        ['--extent', '500'],
    ],
)
def test_what_makes_no_town_is_a_usage_error(tmp_path, monkeypatch, options, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(['simulate', '--out', 'c', *options]) == 2
    assert capsys.readouterr().err.count('\n') == 1
    assert list(tmp_path.iterdir()) == []
