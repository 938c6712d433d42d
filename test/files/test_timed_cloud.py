import numpy as np
import pytest
from plyfile import PlyData, PlyElement
from spinning import sweep

from idem_ros.files.cloud_file import UnreadableCloud, read_cloud
from idem_ros.files.timed_cloud import read_timed_cloud
from idem_ros.refinement.point_time_config import PointTimeConfig

CONFIG = PointTimeConfig()


def table(points, times, dtype='u4', name='t', scale=1e9):
    rows = np.empty(len(points), [('x', 'f4'), ('y', 'f4'), ('z', 'f4'), (name, dtype)])
    rows['x'], rows['y'], rows['z'] = points.T
    rows[name] = (times * scale).astype(dtype)
    return rows


def write_npy(path, rows):
    np.save(path, rows)


def write_ply(path, rows):
    PlyData([PlyElement.describe(rows, 'vertex')]).write(path)


def write_pcd(path, rows):
    names = rows.dtype.names
    kinds = [rows.dtype[name].kind.upper() for name in names]
    header = (
        f'VERSION .7\nFIELDS {" ".join(names)}\n'
        f'SIZE {" ".join(str(rows.dtype[name].itemsize) for name in names)}\n'
        f'TYPE {" ".join(kinds)}\nCOUNT {"1 " * len(names)}\n'
        f'WIDTH {len(rows)}\nHEIGHT 1\nPOINTS {len(rows)}\nDATA binary\n'
    )
    path.write_bytes(header.encode() + rows.tobytes())


def write_csv(path, rows):
    lines = [','.join(rows.dtype.names), *(','.join(map(repr, row)) for row in rows.tolist())]
    path.write_text('\n'.join(lines) + '\n')


WRITERS = {'.npy': write_npy, '.ply': write_ply, '.pcd': write_pcd, '.csv': write_csv}


@pytest.mark.parametrize('suffix', WRITERS)
def test_columns_of_times_are_read_with_the_points(tmp_path, suffix):
    points, times = sweep()
    points[5] = np.nan
    path = tmp_path / f'scan{suffix}'
    WRITERS[suffix](path, table(points, times))
    read, found = read_timed_cloud(path, point_times=CONFIG)
    np.testing.assert_array_equal(read, read_cloud(path))
    np.testing.assert_allclose(found, np.delete(times, 5), atol=1e-8)


def test_absolute_times_of_a_file_count_from_their_begin_or_from_its_stamp(tmp_path):
    points, times = sweep()
    rows = table(points, times + 1.7e9, 'f8', 'timestamp', 1.0)
    np.save(tmp_path / 'scan.npy', rows)
    _, found = read_timed_cloud(tmp_path / 'scan.npy', point_times=CONFIG)
    np.testing.assert_allclose(found, times, atol=1e-6)
    stamp = 1_700_000_000 * 10**9 + 10**8
    _, found = read_timed_cloud(tmp_path / 'scan.npy', point_times=CONFIG, stamp=stamp)
    np.testing.assert_allclose(found, times - 0.1, atol=1e-6)


def test_a_column_without_a_name_is_chosen_by_its_number(tmp_path):
    points, times = sweep()
    np.save(tmp_path / 'scan.npy', np.column_stack([points, 7.0 * points[:, 0], times]))
    columns = (1, 2, 3)
    _, none = read_timed_cloud(tmp_path / 'scan.npy', columns, CONFIG)
    assert none is None
    _, found = read_timed_cloud(tmp_path / 'scan.npy', columns, PointTimeConfig(field='5'))
    np.testing.assert_allclose(found, times)


def test_a_column_that_is_asked_for_and_not_there_is_refused(tmp_path):
    points, times = sweep()
    np.save(tmp_path / 'scan.npy', table(points, times))
    with pytest.raises(UnreadableCloud, match="no one column 'when'.*'x', 'y', 'z', 't'"):
        read_timed_cloud(tmp_path / 'scan.npy', point_times=PointTimeConfig(field='when'))
    np.save(tmp_path / 'bare.npy', points)
    with pytest.raises(UnreadableCloud, match='it has columns 1 to 3'):
        read_timed_cloud(tmp_path / 'bare.npy', point_times=PointTimeConfig(field='9'))


def test_times_that_cannot_be_used_are_left_out_with_a_warning(tmp_path, caplog):
    points, times = sweep()
    np.save(tmp_path / 'scan.npy', table(points, 0.0 * times))
    read, found = read_timed_cloud(tmp_path / 'scan.npy', point_times=CONFIG)
    assert found is None
    assert len(read) == len(points)
    assert 'are the same, 0; taken as none' in caplog.text


def test_a_format_without_times_has_none(tmp_path):
    points, _ = sweep()
    np.column_stack([points, points[:, 0]]).astype('f4').tofile(tmp_path / 'scan.bin')
    assert read_timed_cloud(tmp_path / 'scan.bin', 4, CONFIG)[1] is None
