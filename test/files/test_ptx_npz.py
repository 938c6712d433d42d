"""Scans as Leica's PTX, and arrays in one file of NumPy."""

import logging

import numpy as np
import pytest
from clouds import motion

from idem_ros.files.cloud_file import UnreadableCloud, read_cloud


@pytest.fixture
def points(rng):
    return np.round(rng.normal(size=(60, 3)) * 7, 3)


def ptx(points, T=None, size=(6, 10), after=' 0.5 10 20 30'):
    """Text of a scan of points, in rows, with a pose."""
    T = np.eye(4) if T is None else T
    pose = [*T[:3, 3][None], *T[:3, :3].T]  # p' = p M: the matrix is transposed
    matrix = ''.join(
        ' '.join(map(repr, map(float, (*row, k == 3)))) + '\n'
        for k, row in enumerate([*T[:3, :3].T, T[:3, 3]])
    )
    lines = [f'{size[0]}\n{size[1]}\n']
    lines += [' '.join(map(repr, map(float, row))) + '\n' for row in pose]
    return ''.join([*lines, matrix, *(f'{x} {y} {z}{after}\n' for x, y, z in points.tolist())])


@pytest.mark.parametrize('after', ['', ' 0.5', ' 0.5 10 20 30', ' 10 20 30'])
@pytest.mark.parametrize('end', ['\n', '\r\n'])
def test_a_scan_of_ptx_is_read_in_its_pose(tmp_path, points, rng, after, end):
    T = motion(rng, 40.0, 9.0)
    text = ptx(points, T, after=after).replace('\n', end)
    (tmp_path / 'a.ptx').write_bytes(text.encode())
    moved = points @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(read_cloud(tmp_path / 'a.ptx'), moved, atol=1e-12)


def test_scans_of_ptx_are_put_together_without_what_met_nothing(tmp_path, points, rng, caplog):
    T = motion(rng, 40.0, 9.0)
    empty = points.copy()
    empty[5:9] = 0.0
    (tmp_path / 'a.ptx').write_text(ptx(points) + ptx(empty, T, (10, 6), ' 0.5'))
    moved = np.delete(points, range(5, 9), axis=0) @ T[:3, :3].T + T[:3, 3]
    read = read_cloud(tmp_path / 'a.ptx')
    np.testing.assert_allclose(read, [*points, *moved], atol=1e-12)
    assert 'its 2 scans are put together' in caplog.text
    assert 'of 120 points 4 are not finite' in caplog.text


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda text: text[: len(text) // 2], 'cut off: line 1 begins a scan of 60 points'),
        (lambda text: text + '1 2 3 4\n', 'line 71 .* holds 4 numbers; PTX has 1 there'),
        (lambda text: text.replace('6\n10\n', '6\n9\n', 1), 'PTX has 1 there'),
        (lambda text: text.replace('6\n10\n', '-6\n10\n', 1), 'no size of a grid'),
        (lambda text: text.replace('6\n10\n', 'inf\n10\n', 1), 'no size of a grid'),
        (lambda text: text.replace('6\n10\n', '99999999\n999999\n', 1), 'cut off'),
        (lambda text: text.replace('1.0 0.0 0.0 0.0', '2.0 0.0 0.0 0.0'), 'line 7 begins no pose'),
        (lambda text: text.replace('0.88', 'x', 1), 'line 11 .*x -0.925.* holds no numbers'),
        (lambda text: text.partition('0.5')[2], 'PTX has 1 there'),
    ],
)
def test_what_is_wrong_with_a_ptx_is_said(tmp_path, points, change, words):
    (tmp_path / 'a.ptx').write_text(change(ptx(points)))
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(tmp_path / 'a.ptx')


@pytest.mark.parametrize('suffix', ['.pts', '.xyz', '.txt', '.asc'])
def test_a_ptx_under_the_name_of_a_table_is_told(tmp_path, points, suffix):
    (tmp_path / f'a{suffix}').write_text(ptx(points))
    with pytest.raises(UnreadableCloud, match=r'it is a PTX; its name must end in \.ptx'):
        read_cloud(tmp_path / f'a{suffix}')


@pytest.mark.parametrize('save', [np.savez, np.savez_compressed])
@pytest.mark.parametrize(
    'names',
    [
        ('arr_0',),
        ('points', 'colors'),
        ('Points', 'point_colors', 'normals'),
        ('pcloud_points', 'pcloud_attr.reflectance'),
        ('xyz', 'rgb', 'label'),
        ('lidar_points_xyz', 'camera_position_of_it'),
    ],
)
def test_the_array_of_points_of_an_npz_is_read(tmp_path, points, save, names):
    others = {name: np.zeros((60, 3), 'u1') for name in names[1:]}
    save(tmp_path / 'a.npz', **{names[0]: points, **others})
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.npz'), points)


@pytest.mark.parametrize('shape', [(60,), (6, 10)])
def test_three_arrays_of_an_npz_are_x_y_and_z(tmp_path, points, shape):
    axes = {name: points[:, k].reshape(shape) for k, name in enumerate('xyz')}
    np.savez(tmp_path / 'a.npz', z=axes['z'], y=axes['y'], x=axes['x'], intensity=axes['x'])
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.npz'), points)


def test_columns_of_an_array_in_an_npz_may_be_chosen(tmp_path, points, caplog):
    np.savez(tmp_path / 'a.npz', cloud=np.c_[points, points[:, ::-1]])
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.npz', (6, 5, 4)), points)
    with caplog.at_level(logging.WARNING):
        np.testing.assert_array_equal(read_cloud(tmp_path / 'a.npz'), points)
    assert 'the first three are taken' in caplog.text


@pytest.mark.parametrize(
    ('arrays', 'words'),
    [
        ({}, 'its arrays are none'),
        ({'a': np.ones((9, 3)), 'b': np.ones((9, 3))}, "its arrays are 'a', 'b'; one must be"),
        ({'x': np.ones(9), 'y': np.ones(9), 'z': np.ones(8)}, 'not of one shape'),
        ({'points': np.zeros((10**6, 3))}, 'would inflate'),
        ({'points': np.array([{'a': 1}])}, 'Python objects'),
        ({'labels': np.ones(9)}, r'has shape \(9,\)'),
    ],
)
def test_what_is_wrong_with_an_npz_is_said(tmp_path, arrays, words):
    np.savez_compressed(tmp_path / 'a.npz', **arrays)
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(tmp_path / 'a.npz')


@pytest.mark.parametrize('at', [0.3, 0.6, 0.9])
def test_an_npz_that_is_cut_off_or_spoilt_is_refused(tmp_path, points, at):
    np.savez_compressed(tmp_path / 'a.npz', points)
    content = (tmp_path / 'a.npz').read_bytes()
    cut = int(at * len(content))
    for spoilt in (content[:cut], content[:cut] + b'spoilt' + content[cut + 6 :]):
        (tmp_path / 'a.npz').write_bytes(spoilt)
        with pytest.raises(UnreadableCloud, match=r'a\.npz cannot be read: it'):
            read_cloud(tmp_path / 'a.npz')
