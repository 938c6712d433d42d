"""Layouts of NumPy, bare numbers, LAS and E57 that real tools write."""

import os

import numpy as np
import pytest

from idem_ros.files.cloud_file import READERS, UnreadableCloud, read_cloud
from idem_ros.files.columns import parse_columns


@pytest.fixture
def points(rng):
    return (rng.normal(size=(40, 3)) * 7).astype(np.float32).astype(np.float64)


def assert_reads(path, points, columns=None):
    np.testing.assert_array_equal(read_cloud(path, columns), points)


@pytest.mark.parametrize('shape', [(40,), (8, 5), (40, 1), (2, 4, 5)])
@pytest.mark.parametrize('order', ['<', '>'])
def test_structured_npy_of_any_shape_is_a_cloud(tmp_path, points, shape, order):
    table = np.zeros(shape, [(name, f'{order}f4') for name in ('i', 'z', 'y', 'x')])
    for axis, name in enumerate('xyz'):
        table[name] = points[:, axis].reshape(shape)
    np.save(tmp_path / 'a.npy', table)
    assert_reads(tmp_path / 'a.npy', points)


def test_structured_npy_with_a_field_of_three_is_a_cloud(tmp_path, points):
    table = np.zeros(40, [('xyz', 'f4', 3), ('rgb', 'u1', 3)])
    table['xyz'] = points
    np.save(tmp_path / 'a.npy', table)
    assert_reads(tmp_path / 'a.npy', points)


def test_columns_of_an_array_may_be_chosen(tmp_path, points):
    np.save(tmp_path / 'a.npy', np.c_[np.arange(40), points])
    assert_reads(tmp_path / 'a.npy', points, (2, 3, 4))
    with pytest.raises(UnreadableCloud, match='columns 1 to 4'):
        read_cloud(tmp_path / 'a.npy', (3, 4, 5))


def test_an_npy_that_declares_more_than_it_holds_is_refused_before_it_is_allocated(tmp_path):
    np.save(tmp_path / 'a.npy', np.ones((40, 3)))
    content = (tmp_path / 'a.npy').read_bytes()
    huge = content.replace(b'(40, 3), }', b'(9000000000000, 3), }'[: len(b'(40, 3), }')])
    huge = content.replace(b'(40, 3), }          ', b'(900000000000, 3), }')
    assert len(huge) == len(content)
    assert huge != content
    (tmp_path / 'a.npy').write_bytes(huge)
    with pytest.raises(UnreadableCloud, match='cut off'):
        read_cloud(tmp_path / 'a.npy')


def sweep(count=4800):
    """Points of a spinning scanner in a room, in the order of its measurements; intensities."""
    turn = np.linspace(0, 2 * np.pi, count // 16, endpoint=False)[:, None]
    tilt = np.radians(np.linspace(-15, 15, 16))[None, :]
    rays = np.stack(
        [np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt) + 0 * turn], -1
    ).reshape(-1, 3)
    reach = (np.array([30.0, 20.0, 2.0]) / np.maximum(np.abs(rays), 1e-9)).min(axis=1)
    return rays * reach[:, None], np.abs(np.sin(np.arange(len(rays)) * 0.1))


def with_columns(kind):
    xyz, intensity = sweep()
    ring, time = np.arange(len(xyz)) % 16, np.linspace(0, 0.1, len(xyz))
    return {
        'xyz': xyz,
        'xyzi': np.c_[xyz, intensity],
        'xyzi in 255': np.c_[xyz, np.round(255 * intensity)],
        'xyzir': np.c_[xyz, intensity, ring],
        'xyzirt': np.c_[xyz, intensity, ring, time],
        'xyz and normals': np.c_[xyz, np.cos(xyz)],
    }[kind]


@pytest.mark.parametrize('dtype', ['<f4', '<f8'])
@pytest.mark.parametrize(
    'kind', ['xyz', 'xyzi', 'xyzi in 255', 'xyzir', 'xyzirt', 'xyz and normals']
)
@pytest.mark.parametrize('shuffled', [False, True])
def test_bare_numbers_say_themselves_how_many_columns_they_are(
    tmp_path, rng, kind, dtype, shuffled
):
    rows = with_columns(kind).astype(dtype)
    rows = rng.permutation(rows) if shuffled else rows
    rows.tofile(tmp_path / 'a.bin')
    assert_reads(tmp_path / 'a.bin', rows[:, :3].astype(np.float64))


@pytest.mark.parametrize('count', [8, 10])
@pytest.mark.parametrize('dtype', ['<f4', '<f8'])
def test_more_columns_than_are_looked_for_are_refused_and_the_option_reads_them(
    tmp_path, count, dtype
):
    """As PCL keeps points in memory: x y z and a pad, the intensity and three."""
    rows = np.zeros((4800, count), dtype)
    rows[:, :3], rows[:, 4] = sweep()
    rows.tofile(tmp_path / 'a.bin')
    with pytest.raises(UnreadableCloud, match=f'look like {count} columns of .*; --columns'):
        read_cloud(tmp_path / 'a.bin')
    assert_reads(tmp_path / 'a.bin', rows[:, :3].astype(np.float64), count)


@pytest.mark.parametrize('dtype', ['<f4', '<f8'])
def test_homogeneous_coordinates_are_four_columns(tmp_path, dtype):
    rows = np.c_[sweep()[0], np.ones(4800)].astype(dtype)
    rows.tofile(tmp_path / 'a.bin')
    assert_reads(tmp_path / 'a.bin', rows[:, :3].astype(np.float64))


@pytest.mark.parametrize('columns', [3, 4])
def test_all_of_x_before_all_of_y_is_no_row_of_points(tmp_path, columns):
    with_columns('xyzi')[:, :columns].T.astype('<f4').tofile(tmp_path / 'a.bin')
    with pytest.raises(UnreadableCloud, match='all x, then all y'):
        read_cloud(tmp_path / 'a.bin')


def test_nuscenes_has_five_columns_by_its_name(tmp_path):
    rows = with_columns('xyzir').astype('<f4')
    rows.tofile(tmp_path / 'a.pcd.bin')
    assert_reads(tmp_path / 'a.pcd.bin', rows[:, :3].astype(np.float64))


def test_what_cannot_be_told_is_refused_and_the_option_decides(tmp_path, rng):
    numbers = rng.normal(size=480).astype('<f4')
    numbers.tofile(tmp_path / 'a.bin')
    with pytest.raises(UnreadableCloud, match='--columns says how many'):
        read_cloud(tmp_path / 'a.bin')
    for columns in (3, 4, 5, 6):
        assert_reads(tmp_path / 'a.bin', numbers.reshape(-1, columns)[:, :3], columns)
    with pytest.raises(UnreadableCloud, match='of 7 columns'):
        read_cloud(tmp_path / 'a.bin', 7)


def test_a_scan_that_is_cut_off_between_two_numbers_is_no_other_layout(tmp_path):
    rows = with_columns('xyzi').astype('<f4')
    (tmp_path / 'a.bin').write_bytes(rows.tobytes()[:-4])
    with pytest.raises(UnreadableCloud, match='a.bin'):
        read_cloud(tmp_path / 'a.bin')


@pytest.mark.parametrize(
    'content', [b'\x00' * 4800, b'text, no numbers. ' * 80, np.arange(4800, dtype='>f4').tobytes()]
)
def test_what_are_no_coordinates_is_refused(tmp_path, content):
    (tmp_path / 'a.bin').write_bytes(content)
    with pytest.raises(UnreadableCloud, match='a.bin'):
        read_cloud(tmp_path / 'a.bin')


@pytest.mark.parametrize('suffix', READERS)
def test_pipes_and_devices_are_refused_at_once(tmp_path, suffix):
    os.mkfifo(tmp_path / f'pipe{suffix}')
    (tmp_path / f'device{suffix}').symlink_to('/dev/zero')
    for name in ('pipe', 'device'):
        with pytest.raises(UnreadableCloud, match='a pipe, a socket or a device'):
            read_cloud(tmp_path / f'{name}{suffix}')


@pytest.mark.parametrize('chunk', [2**31, 2**32 - 2])
def test_chunks_of_a_laz_that_no_writer_makes_are_refused_before_they_are_allocated(
    tmp_path, points, chunk
):
    laspy = pytest.importorskip('laspy', reason='needs the extra survey')
    las = laspy.create(point_format=3, file_version='1.4')
    las.x, las.y, las.z = points.T
    las.write(tmp_path / 'a.laz')
    content = bytearray((tmp_path / 'a.laz').read_bytes())
    at = content.index(b'laszip encoded') + 52 + 12  # of the record that says how it is packed
    assert content[at : at + 4] == (50_000).to_bytes(4, 'little')
    content[at : at + 4] = chunk.to_bytes(4, 'little')
    (tmp_path / 'a.laz').write_bytes(content)
    with pytest.raises(UnreadableCloud, match='a chunk is said to hold'):
        read_cloud(tmp_path / 'a.laz')


@pytest.mark.parametrize('suffix', ['.las', '.laz'])
def test_las_is_read_with_scale_and_offset(tmp_path, points, suffix):
    laspy = pytest.importorskip('laspy', reason='needs the extra survey')
    las = laspy.create(point_format=3, file_version='1.2')
    las.header.offsets, las.header.scales = (431_000, 5_412_000, 0), (0.001,) * 3
    las.x, las.y, las.z = (points + (431_234.5, 5_412_345.6, 312.0)).T
    las.write(tmp_path / f'a{suffix}')
    read = read_cloud(tmp_path / f'a{suffix}')
    np.testing.assert_allclose(read, points + (431_234.5, 5_412_345.6, 312.0), atol=6e-4)
    content = (tmp_path / f'a{suffix}').read_bytes()
    (tmp_path / f'cut{suffix}').write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(UnreadableCloud, match='cut'):
        read_cloud(tmp_path / f'cut{suffix}')


@pytest.mark.parametrize('how', ['GeoTIFF', 'WKT'])
@pytest.mark.parametrize('is_geographic', [True, False])
def test_las_in_degrees_is_refused(tmp_path, points, how, is_geographic):
    laspy = pytest.importorskip('laspy')
    known = pytest.importorskip('laspy.vlrs.known')
    if how == 'WKT':
        wkt = 'GEOGCS["WGS 84",DATUM["WGS_1984"]]'
        record = known.WktCoordinateSystemVlr(wkt if is_geographic else f'PROJCS["UTM",{wkt}]')
    else:
        record = known.GeoKeyDirectoryVlr()
        record.geo_keys = [known.GeoKeyEntryStruct(1024, 0, 1, 2 if is_geographic else 1)]
        record.geo_keys_header.number_of_keys = 1
    las = laspy.create(point_format=6, file_version='1.4')
    las.header.vlrs.append(record)
    las.header.scales = (0.001,) * 3
    las.x, las.y, las.z = points.T
    las.write(tmp_path / 'a.las')
    if is_geographic:
        with pytest.raises(UnreadableCloud, match='longitude and latitude'):
            read_cloud(tmp_path / 'a.las')
    else:
        assert read_cloud(tmp_path / 'a.las').shape == points.shape


def test_the_scans_of_an_e57_are_put_together_in_their_poses(tmp_path, points, caplog):
    pye57 = pytest.importorskip('pye57', reason='needs the extra survey')
    file = pye57.E57(str(tmp_path / 'a.e57'), mode='w')
    for shift in (0.0, 100.0):
        columns = {f'cartesian{axis}': points[:, k].copy() for k, axis in enumerate('XYZ')}
        file.write_scan_raw(columns, translation=np.array([shift, 0.0, 0.0]))
    file.close()
    expected = np.vstack([points, points + (100.0, 0, 0)])
    np.testing.assert_allclose(read_cloud(tmp_path / 'a.e57'), expected, atol=1e-6)
    assert 'its 2 scans are put together' in caplog.text
    content = (tmp_path / 'a.e57').read_bytes()
    for name, damaged in (('cut', content[:2000]), ('text', b'no E57' * 99)):
        (tmp_path / f'{name}.e57').write_bytes(damaged)
        with pytest.raises(
            UnreadableCloud, match='cut off, damaged or no E57: [a-z ]+'
        ) as refused:
            read_cloud(tmp_path / f'{name}.e57')
        assert 'Debug' not in str(refused.value)


@pytest.mark.parametrize(
    ('text', 'columns'),
    [('4', 4), ('2,3,4', (2, 3, 4)), ('e, n,h', ('e', 'n', 'h')), ('1,b,3', (1, 'b', 3))],
)
def test_the_option_takes_a_number_or_three(text, columns):
    assert parse_columns(text) == columns


@pytest.mark.parametrize('text', ['', 'a', '1,2', '1,2,3,4', ',,', '-3', '99999'])
def test_the_option_refuses_what_chooses_nothing(text):
    with pytest.raises(ValueError, match='neither'):
        parse_columns(text)
