"""Tables without names whose first columns are no coordinates."""

import logging

import numpy as np
import pytest

from idem_ros.files.cloud_file import UnreadableCloud, cloud_parts, read_cloud


@pytest.fixture
def points(rng):
    return np.round(rng.normal(size=(60, 3)) * 7, 3)


ROWS = np.arange(60.0)
GREY = ROWS * 0.37 % 1.0
BEFORE = {
    'row and column (Faro)': np.c_[ROWS // 8, ROWS % 8],
    'scan, row and column': np.c_[ROWS // 30, ROWS // 8, ROWS % 8],
    'numbers with gaps': ROWS * 3 + ROWS // 7,
    'classes': ROWS % 5,
    'times since 1970': 1.6e9 + ROWS * 0.001,
    'one time': 1.6e9 + 0.0 * ROWS,
    'times since the first': ROWS * 0.0005,
}


@pytest.mark.parametrize('before', BEFORE)
@pytest.mark.parametrize('suffix', ['.xyz', '.csv', '.npy', '.npz'])
def test_what_comes_before_x_y_z_is_not_taken_for_them(tmp_path, points, before, suffix):
    table = np.c_[BEFORE[before], points, GREY]
    first = table.shape[1] - 3
    path = written(tmp_path / f'scan{suffix}', table)
    with pytest.raises(UnreadableCloud, match='no header says .* the first .*--columns says'):
        read_cloud(path)
    np.testing.assert_array_equal(read_cloud(path, (first, first + 1, first + 2)), points)


def written(path, table):
    if path.suffix == '.npz':
        np.savez(path, table)
    elif path.suffix == '.npy':
        np.save(path, table)
    else:
        np.savetxt(path, table, '%.9g', ',' if path.suffix == '.csv' else ' ')
    return path


def test_ranges_before_the_points_are_told_by_their_lengths(tmp_path, points):
    """As the raw points of Waymo: range, intensity, elongation, x, y, z."""
    np.save(tmp_path / 'a.npy', np.c_[np.linalg.norm(points, axis=1), GREY, GREY, points])
    with pytest.raises(UnreadableCloud, match='distance of the points of columns 4 to 6'):
        read_cloud(tmp_path / 'a.npy')


@pytest.mark.parametrize('suffix', ['.xyz', '.npy', '.npz'])
@pytest.mark.parametrize('kind', ['as given', 'sorted', 'whole', 'a grid'])
def test_points_that_come_first_are_read_and_it_is_said(tmp_path, points, suffix, kind, caplog):
    points = {
        'as given': points,
        'sorted': points[np.argsort(points[:, 0])],
        'whole': np.round(points * 1000),
        'a grid': np.c_[ROWS // 8 * 2, ROWS % 8 * 2, points[:, 2]],
    }[kind]
    path = written(tmp_path / f'scan{suffix}', np.c_[points, GREY])
    with caplog.at_level(logging.WARNING):
        np.testing.assert_array_equal(np.vstack(list(cloud_parts(path))), points)
    assert caplog.text.count('the first three are taken') == 1


@pytest.mark.parametrize('between', ['\t', ';', '|'])
@pytest.mark.parametrize('head', [True, False])
def test_blanks_group_thousands_where_something_else_separates(tmp_path, points, between, head):
    """As French, Polish and Swedish desktops write."""
    far = points + (431_234.0, 5_412_345.0, 0.0)
    swap = str.maketrans({',': ' ', '.': ','})
    rows = [between.join(f'{c:,.3f}'.translate(swap) for c in point) for point in far]
    rows = [between.join('xyz'), *rows] if head else rows
    (tmp_path / 'a.txt').write_text('\n'.join(rows))
    np.testing.assert_allclose(read_cloud(tmp_path / 'a.txt'), far, atol=1e-9)


def test_whole_numbers_between_commas_and_blanks_are_no_fractions(tmp_path):
    rows = ['1.5, 2, 3', *(f'{k}, {k * k}, {-k}' for k in range(900))]
    (tmp_path / 'a.xyz').write_text('\n'.join(rows))
    read = read_cloud(tmp_path / 'a.xyz')
    assert read[0].tolist() == [1.5, 2.0, 3.0]
    assert read[-1].tolist() == [899.0, 899.0**2, -899.0]


def test_fractions_without_zeros_at_their_end_are_torn_too(tmp_path, rng):
    """As Excel writes: 3,71 beside 3,332."""
    numbers = np.round(rng.uniform(1, 9, (80, 3)), 3) + 1e-5
    rows = [','.join(f'{c:.6g}'.replace('.', ',') for c in row) for row in numbers]
    (tmp_path / 'a.csv').write_text('\n'.join(row.replace('001', '') for row in rows))
    with pytest.raises(UnreadableCloud, match='a comma is both'):
        read_cloud(tmp_path / 'a.csv')


NANS = ['nan', '-nan', 'NaN', '-nan(ind)', 'nan(snan)', '-1.#IND', '1.#QNAN', '1.#INF00', '-inf']


@pytest.mark.parametrize('word', NANS)
@pytest.mark.parametrize('at', ['first', 'last'])
@pytest.mark.parametrize('suffix', ['.xyz', '.pcd', '.ply'])
def test_what_is_no_number_is_counted_however_it_is_written(
    tmp_path, points, word, at, suffix, caplog
):
    rows = [' '.join(map(str, point)) for point in points.tolist()]
    rows.insert(0 if at == 'first' else 60, ' '.join([word] * 3))
    head = {
        '.xyz': '',
        '.pcd': 'FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 61\nHEIGHT 1\nDATA ascii\n',
        '.ply': 'ply\nformat ascii 1.0\nelement vertex 61\nproperty double x\n'
        'property double y\nproperty double z\nend_header\n',
    }[suffix]
    (tmp_path / f'a{suffix}').write_text(head + '\n'.join(rows) + '\n')
    np.testing.assert_array_equal(read_cloud(tmp_path / f'a{suffix}'), points)
    assert 'of 61 points 1 are not finite' in caplog.text


@pytest.mark.parametrize('word', ['#N/A', '#NV', '#DIV/0!', '#WERT!', '#ZAHL!'])
def test_errors_of_excel_are_no_numbers(tmp_path, points, word, caplog):
    rows = [f'{word};1,5;2,5', f'1,5;2,5;{word}']
    rows += [';'.join(map(str, point)).replace('.', ',') for point in points.tolist()]
    (tmp_path / 'a.csv').write_text('\n'.join(['x;y;z', *rows]))
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.csv'), points)
    assert 'of 62 points 2 are not finite' in caplog.text


def test_a_first_row_that_numbers_the_columns_is_no_point(tmp_path, points):
    np.savetxt(tmp_path / 'a.csv', points, '%.3f', ',', header='1,2,3', comments='')
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.csv'), points)


@pytest.mark.parametrize(
    ('header', 'words'),
    [
        ('X [m];Y [m];Z [ft]', 'are in ft and m'),
        ('X [deg];Y [deg];Z [m]', 'are in deg and m'),
        ('X(rad);Y(rad);Z(rad)', 'are in rad'),
    ],
)
def test_units_that_differ_or_are_angles_are_refused(tmp_path, points, header, words):
    np.savetxt(tmp_path / 'a.csv', points, '%.3f', ';', header=header, comments='')
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(tmp_path / 'a.csv')


@pytest.mark.parametrize('unit', ['', ' [m]', ' (mm)', '[Feet]'])
def test_a_unit_that_is_not_the_metre_is_said(tmp_path, points, unit, caplog):
    header = ';'.join(axis + unit for axis in 'XYZ')
    np.savetxt(tmp_path / 'a.csv', points, '%.3f', ';', header=header, comments='')
    np.testing.assert_array_equal(read_cloud(tmp_path / 'a.csv'), points)
    assert ('its header has x, y and z in' in caplog.text) == (unit in (' (mm)', '[Feet]'))
