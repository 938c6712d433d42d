import numpy as np
import pytest

from idem_ros.commands.main import main
from idem_ros.maps.open_map import open_map
from idem_ros.maps.tile_index import METADATA


@pytest.fixture
def folder(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save('map.npy', rng.uniform(-100, 100, (5000, 3)) * (1, 1, 0.05))
    return tmp_path


def test_a_map_is_cut_into_tiles(folder, capsys):
    assert main(['map', 'tile', 'map.npy', '--out', 'tiles']) == 0
    assert capsys.readouterr().out == 'tiles: 4 tiles of 100 x 100 m, 5000 points\n'
    assert sorted(path.name for path in (folder / 'tiles').iterdir()) == [
        *('-100_-100.pcd', '-100_0.pcd', '0_-100.pcd', '0_0.pcd'),
        METADATA,
    ]


def test_tiles_are_cut_anew_in_another_size(folder, capsys):
    main(['map', 'tile', 'map.npy', '--out', 'tiles'])
    assert main(['map', 'tile', 'tiles', '--size', '25', '--out', 'small']) == 0
    assert '64 tiles of 25 x 25 m, 5000 points' in capsys.readouterr().out
    opened = open_map('small')
    assert len(opened.points_within(*opened.bounds)) == 5000


@pytest.mark.parametrize(
    ('argv', 'code', 'says'),
    [
        (['none.npy', '--out', 'tiles'], 1, 'is not there'),
        (['map.npy', '--out', 'tiles', '--size', '0'], 2, 'whole number of metres'),
        (['map.npy', '--out', '.'], 1, 'is not empty'),
        (['cut.pcd', '--out', 'tiles'], 1, 'cut off'),
        (['empty', '--out', 'tiles'], 1, 'holds 0 clouds'),
    ],
)
def test_what_cannot_be_cut_is_said_in_one_line_and_nothing_is_left(
    folder, capsys, argv, code, says
):
    (folder / 'empty').mkdir()
    (folder / 'cut.pcd').write_bytes(
        b'FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 9\nDATA binary\n' + bytes(50)
    )
    assert main(['map', 'tile', *argv]) == code
    said = capsys.readouterr().err
    assert says in said
    assert said.count('\n') == 1
    assert sorted(path.name for path in folder.iterdir()) == ['cut.pcd', 'empty', 'map.npy']
