"""Maps on disk: the points of a box from one file and from tiles, and maps that cannot be used."""

import logging

import numpy as np
import pytest
import yaml
from plyfile import PlyData, PlyElement

from idem_ros.files.cloud_file import UnreadableCloud
from idem_ros.files.pcd_file import write_pcd
from idem_ros.maps.open_map import open_map
from idem_ros.maps.source import UnusableMap
from idem_ros.maps.tile_index import METADATA, find_map
from idem_ros.maps.tile_writer import cut_map

BOXES = [
    ((-1e3, -1e3, -1e3), (1e3, 1e3, 1e3)),
    ((10.0, -20.0, -5.0), (42.0, 12.0, 5.0)),
    ((99.0, 99.0, 0.0), (101.0, 101.0, 2.0)),
    ((500.0, 500.0, 0.0), (501.0, 501.0, 1.0)),
]


@pytest.fixture
def points(rng):
    """A place of 300 m x 200 m around zero, as float32 holds it."""
    points = rng.uniform((-150, -100, -2), (150, 100, 6), (30_000, 3))
    return points.astype(np.float32).astype(np.float64)


@pytest.fixture
def tiles(tmp_path, points):
    np.save(tmp_path / 'map.npy', points)
    cut_map(tmp_path / 'map.npy', tmp_path / 'tiles', 50)
    return tmp_path / 'tiles'


def within(points, low, high):
    return sorted(map(tuple, points[((points >= low) & (points < high)).all(axis=1)]))


@pytest.mark.parametrize('box', BOXES)
@pytest.mark.parametrize('kind', ['file', 'tiles'])
def test_the_points_of_a_box_are_those_of_the_map_that_lie_in_it(tiles, points, kind, box):
    opened = open_map(tiles if kind == 'tiles' else tiles.parent / 'map.npy')
    found = opened.points_within(*box)
    assert sorted(map(tuple, found)) == within(points, *box)
    np.testing.assert_array_equal(opened.points_within(*box), found)
    assert (opened.bounds[0] <= points.min(axis=0)).all()
    assert (opened.bounds[1] >= points.max(axis=0)).all()


def test_tiles_are_in_the_layout_that_autoware_reads(tiles, points):
    metadata = yaml.safe_load((tiles / METADATA).read_text())
    assert (metadata.pop('x_resolution'), metadata.pop('y_resolution')) == (50.0, 50.0)
    assert sorted(metadata) == sorted(path.name for path in tiles.glob('*.pcd'))
    assert len(metadata) == 6 * 4
    for name, corner in metadata.items():
        assert all(isinstance(each, int) for each in corner)
        header = (tiles / name).read_bytes()[:400]
        assert b'SIZE 4 4 4' in header


def test_the_metadata_may_lie_beside_the_folder_of_tiles(tiles):
    (tiles / METADATA).rename(tiles.parent / METADATA)
    tiles.rename(tiles.parent / 'pointcloud_map.pcd')
    for path in (tiles.parent / 'pointcloud_map.pcd', tiles.parent):
        found = find_map(path).paths
        assert len(found) == 24
        assert all(tile.is_file() for tile in found)


def test_what_is_far_from_the_scans_is_forgotten(tiles):
    opened = open_map(tiles)
    everywhere = opened.bounds
    opened.points_within(*everywhere)
    whole = opened.nbytes
    opened.keep_near((0.0, 0.0, 0.0), reach=20.0)
    assert 0 < opened.nbytes < 0.3 * whole
    opened.keep_near((1e6, 0.0, 0.0), reach=20.0)
    assert opened.nbytes == 0


def test_tiles_in_memory_are_bounded_by_their_bytes(tiles, points):
    from idem_ros.maps.tile_folder import TileFolder

    bounded = TileFolder(find_map(tiles), most_bytes=points.nbytes // 8)
    assert len(bounded.points_within(*bounded.bounds)) == len(points)
    assert 0 < bounded.nbytes <= points.nbytes // 8


def test_a_tile_that_cannot_be_read_is_named_once_and_the_rest_serves(tiles, points, caplog):
    (tiles / '0_0.pcd').write_bytes(b'garbage')
    opened = open_map(tiles)
    for _ in range(3):
        found = opened.points_within(*opened.bounds)
    in_tile = ((points[:, :2] >= 0) & (points[:, :2] < 50)).all(axis=1)
    assert len(found) == len(points) - in_tile.sum()
    assert [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING] == [
        f'tile left out of the map: {tiles / "0_0.pcd"} cannot be read: it has no line DATA, so '
        'it is no PCD file or cut off'
    ]


def test_a_tile_that_is_missing_is_named_and_one_that_is_empty_or_of_another_map(tiles, caplog):
    (tiles / '0_0.pcd').unlink()
    empty = (tiles / '50_0.pcd').read_bytes().partition(b'WIDTH')[0]
    (tiles / '50_0.pcd').write_bytes(empty + b'WIDTH 0\nHEIGHT 1\nPOINTS 0\nDATA binary\n')
    write_pcd(tiles / '100_0.pcd', np.full((100, 3), 7.0))
    opened = open_map(tiles)
    assert len(opened.points_within((0, 0, -9), (150, 50, 9))) == 0
    said = '\n'.join(record.getMessage() for record in caplog.records)
    assert f'{tiles}: its metadata name, but it lacks 0_0.pcd' in said
    assert 'it says itself that it holds 0 points' in said
    assert '100 of its 100 points lie outside of its box' in said


SPOILT = {
    'no metadata': (lambda folder: (folder / METADATA).unlink(), 'idem map tile'),
    'no YAML': (lambda folder: (folder / METADATA).write_text('{'), 'is no YAML'),
    'no resolution': (lambda folder: edit(folder, x_resolution=None), "x_resolution is 'None'"),
    'resolution 0': (lambda folder: edit(folder, y_resolution=0.0), 'y_resolution is 0.0'),
    'a corner of three': (lambda folder: edit(folder, **{'0_0.pcd': [1, 2, 3]}), '[1, 2, 3]'),
    'a tile elsewhere': (lambda folder: edit(folder, **{'../x.pcd': [1, 2]}), 'must be a file of'),
    'no tile': (lambda folder: [path.unlink() for path in folder.glob('*.pcd')], 'holds none of'),
    'millimetres': (lambda folder: in_millimetres(folder), 'is it in millimetres?'),
}


def edit(folder, **changes):
    metadata = yaml.safe_load((folder / METADATA).read_text())
    metadata.update({name: str(v) if v is None else v for name, v in changes.items()})
    (folder / METADATA).write_text(yaml.safe_dump(metadata))


def in_millimetres(folder):
    rng = np.random.default_rng(1)
    for path in folder.iterdir():
        path.unlink()
    np.save(folder / 'map.npy', rng.uniform(0, 100_000, (20_000, 3)) * (1, 1, 0.05))


@pytest.mark.parametrize('kind', SPOILT)
def test_a_map_that_cannot_be_used_is_refused_in_one_line(tiles, kind):
    spoil, says = SPOILT[kind]
    spoil(tiles)
    with pytest.raises(UnusableMap) as refused:
        open_map(tiles)
    assert says in str(refused.value)
    assert '\n' not in str(refused.value)


def test_a_path_that_leads_nowhere_is_refused(tmp_path):
    with pytest.raises(UnusableMap, match='is not there'):
        open_map(tmp_path / 'none.pcd')
    (tmp_path / 'map.doc').write_bytes(b'x')
    with pytest.raises(UnreadableCloud, match='suffix'):
        open_map(tmp_path / 'map.doc')


def test_nan_duplicates_and_strays_leave_the_rest_as_it_is(tmp_path, points, caplog):
    spoilt = np.concatenate([points, points[:100], np.full((50, 3), np.nan), np.zeros((9, 3))])
    spoilt = np.concatenate([spoilt, [[1e9, 0, 0], [0, -1e9, 0], [0, 0, 1e9]]])
    np.save(tmp_path / 'map.npy', spoilt)
    cut_map(tmp_path / 'map.npy', tmp_path / 'tiles', 50)
    expected = sorted(map(tuple, np.concatenate([points, points[:100]])))
    for path in ('map.npy', 'tiles'):
        opened = open_map(tmp_path / path)
        assert np.abs(opened.bounds[:, :2]).max() < 1000.0
        found = opened.points_within((-1e3, -1e3, -1e3), (1e3, 1e3, 1e3))
        assert sorted(map(tuple, found)) == expected
    said = '\n'.join(record.getMessage() for record in caplog.records)
    assert '3 points far from all the rest are left out' in said
    assert '50 are not finite and 9 exactly zero' in said


def test_many_strays_do_not_hide_each_other(tmp_path, points, rng):
    strays = 1e9 * rng.normal(size=(len(points) // 10, 3))
    np.save(tmp_path / 'map.npy', np.concatenate([points, strays]))
    assert len(open_map(tmp_path / 'map.npy')) == len(points)


def test_utm_coordinates_lose_no_millimetre(tmp_path, points):
    utm = points.round(4) + (4e5, 5e6, 0.0)
    np.save(tmp_path / 'map.npy', utm)
    cut = cut_map(tmp_path / 'map.npy', tmp_path / 'tiles', 50)
    assert cut.is_float64
    opened = open_map(tmp_path / 'tiles')
    found = opened.points_within(*opened.bounds)
    np.testing.assert_array_equal(np.sort(found, axis=0), np.sort(utm, axis=0))


@pytest.mark.parametrize('suffix', ['.las', '.laz', '.ply', '.xyz'])
def test_maps_of_every_format_are_cut_and_opened(tmp_path, points, suffix):
    write(tmp_path / f'map{suffix}', points.round(3) + (4e5, 5e6, 0.0))
    cut_map(tmp_path / f'map{suffix}', tmp_path / 'tiles', 50)
    for name in (f'map{suffix}', 'tiles'):
        opened = open_map(tmp_path / name)
        found = opened.points_within(opened.bounds[0], opened.bounds[1] + 1.0)
        expected = np.sort(points.round(3) + (4e5, 5e6, 0.0), axis=0)
        np.testing.assert_allclose(np.sort(found, axis=0), expected, rtol=0, atol=1e-6)


def write(path, points):
    if path.suffix == '.xyz':
        np.savetxt(path, points, fmt='%.3f')
    elif path.suffix == '.ply':
        vertices = np.rec.fromarrays(points.T, names='x,y,z')
        PlyData([PlyElement.describe(np.array(vertices), 'vertex')]).write(path)
    else:
        laspy = pytest.importorskip('laspy', reason='the extra survey is not installed')
        header = laspy.LasHeader(point_format=3, version='1.2')
        header.offsets, header.scales = points.min(axis=0), [0.001] * 3
        las = laspy.LasData(header)
        las.x, las.y, las.z = points.T
        las.write(path)


def test_what_is_read_is_said(tiles, caplog):
    said = []
    open_map(tiles, said.append)
    open_map(tiles.parent / 'map.npy', said.append)
    assert said[0] == f'map {tiles}: 24 tiles of 50 x 50 m, read as they are needed'
    assert said[1].startswith(f'map {tiles.parent / "map.npy"}: 30000 points, 300 x 200 x 8 m')
    assert not caplog.get_records('call') or caplog.records[0].levelno < logging.WARNING
