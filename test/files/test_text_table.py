import logging

import numpy as np
import pytest

from idem_ros.files.cloud_file import UnreadableCloud, read_cloud


@pytest.fixture
def points(rng):
    return np.round(rng.normal(size=(60, 3)) * 7, 4)


def written(path, rows, head='', encoding='utf-8'):
    path.write_text(head + ''.join(row + '\n' for row in rows), encoding=encoding, newline='')
    return path


def rows_of(points, between=',', before=(), after=()):
    """Rows of text; `before` and `after` are columns given by a function of the row's number."""
    for i, point in enumerate(points):
        cells = [f(i) for f in before] + [f'{c:.4f}' for c in point] + [f(i) for f in after]
        yield between.join(cells)


def number(i):
    return str(i)


def grey(i):
    return str(i * 37 % 255)


def assert_reads(path, points, columns=None):
    np.testing.assert_array_equal(read_cloud(path, columns), points)


@pytest.mark.parametrize('between', [',', ';', '\t', ' ', '|', ', '])
def test_an_index_column_without_a_name_is_a_column(tmp_path, points, between):
    """As pandas writes: ,x,y,z,intensity."""
    rows = rows_of(points, between, [number], [grey])
    head = between.join(['""' if between == ' ' else '', 'x', 'y', 'z', 'intensity']) + '\n'
    assert_reads(written(tmp_path / 'scan.csv', rows, head), points)


def test_names_that_lost_the_blank_one_are_refused(tmp_path, points):
    path = written(tmp_path / 'scan.csv', rows_of(points, ' ', [number]), ' x y z\n')
    with pytest.raises(UnreadableCloud, match='names 3 columns, and line 2 .* holds 4'):
        read_cloud(path)


@pytest.mark.parametrize('between', [' ', ',', '\t'])
def test_names_of_rows_that_are_quoted_need_none_themselves(tmp_path, points, between):
    """As write.table of R writes."""
    rows = rows_of(points, between, [lambda i: f'"{i + 1}"'], [lambda _: '"on the ground"'])
    head = between.join(['"x"', '"y"', '"z"', '"class"']) + '\n'
    assert_reads(written(tmp_path / 'scan.txt', rows, head), points)


@pytest.mark.parametrize('rows', [3, 4])
def test_points_in_columns_are_refused(tmp_path, points, rows):
    """As MATLAB holds them."""
    across = np.vstack([points.T, np.ones(len(points))])[:rows]
    np.savetxt(tmp_path / 'scan.txt', across)
    np.save(tmp_path / 'scan.npy', across)
    with pytest.raises(UnreadableCloud, match='a point must be a row'):
        read_cloud(tmp_path / 'scan.txt')
    with pytest.raises(UnreadableCloud, match='a point a row'):
        read_cloud(tmp_path / 'scan.npy')


def test_numbers_for_names_with_an_index_are_refused_and_columns_decide(tmp_path, points):
    """As pandas writes an array: ,0,1,2."""
    path = written(tmp_path / 'scan.csv', rows_of(points, ',', [number]), ',0,1,2\n')
    with pytest.raises(UnreadableCloud, match="'', '0', '1', '2'.*--columns"):
        read_cloud(path)
    for columns in (('0', '1', '2'), (0, 1, 2), (2, 3, 4)):
        assert_reads(path, points, columns)


def test_numbers_for_names_without_an_index_are_no_point(tmp_path, points):
    assert_reads(written(tmp_path / 'scan.csv', rows_of(points), '0,1,2\n'), points)


@pytest.mark.parametrize(
    'comment', ['# id x y z', '#id,x,y,z', '//id X Y Z', '% id x y z', '# a\n#  id  x  y  z ']
)
def test_a_comment_before_the_rows_names_columns(tmp_path, points, comment):
    rows = rows_of(points, ' ', [number])
    assert_reads(written(tmp_path / 'scan.xyz', rows, comment + '\n'), points)


@pytest.mark.parametrize('between', [';', '\t', ' ', '  '])
@pytest.mark.parametrize('head', [True, False])
def test_a_comma_is_the_decimal_sign_where_something_else_separates(
    tmp_path, points, between, head
):
    rows = [row.replace('.', ',') for row in rows_of(points, between, after=[grey])]
    names = between.join('xyzi') + '\n' if head else ''
    assert_reads(written(tmp_path / 'scan.txt', rows, names), points)


def test_decimal_commas_in_quotes_between_commas(tmp_path, points):
    rows = [','.join(f'"{c:.4f}"'.replace('.', ',') for c in point) for point in points]
    assert_reads(written(tmp_path / 'scan.csv', rows, '"x","y","z"\n'), points)


@pytest.mark.parametrize(('thousands', 'decimal'), ['.,', ',.', "'.", '\xa0,', '\u202f,', '’.'])
def test_thousands_are_grouped_as_in_either_half_of_the_world(
    tmp_path, points, thousands, decimal
):
    far = points + (431_234.0, 5_412_345.0, 0.0)
    swap = str.maketrans({',': thousands, '.': decimal})
    rows = [';'.join(f'{c:,.4f}' for c in point).translate(swap) for point in far]
    np.testing.assert_allclose(read_cloud(written(tmp_path / 'scan.csv', rows)), far, atol=1e-4)


@pytest.mark.parametrize(
    'text',
    [
        'x;y;z\n1,5;2,5;3,5\n1.5;2.5;3.5\n',
        'x;y;z\n1.234,5;2,5;3,5\n2.5;2,5;3,5\n',
        'x;y;z\n' + '1,234.5;2.5;3.5\n' * 999 + '3,5;2.5;3.5\n' + '1,234.5;2.5;3.5\n' * 999,
        'x,y,z\n' + '3,0712,3,0332,-0,0034\n' * 9,
        '3,0712,3,0332,-0,0034\n' * 9,
        '3,712,3,332,-1,534\n2,123,4,521,3,777\n' * 9,
    ],
)
def test_what_contradicts_its_own_decimal_sign_is_refused(tmp_path, text):
    (tmp_path / 'scan.csv').write_text(text)
    with pytest.raises(UnreadableCloud, match='decimal|holds 6|no number'):
        read_cloud(tmp_path / 'scan.csv')


@pytest.mark.parametrize(
    'names',
    [
        'intensity,laser_id,azimuth,Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2',
        'a,b,c,X[m],Y[m],Z[m]',
        'a,b,c,X (m),Y (m),Z (m)',
        'a,b,c,"X [m]","Y [m]","Z [m]"',
        'a,b,c,Points:0,Points:1,Points:2',
        'a,b,c,Points_0,Points_1,Points_2',
        'Time,b,c,Easting,Northing,Elevation',
        'a,b,c,east,north,up',
        'Point,Code,Note,E,N,H',
        'a,b,c,position_x,position_y,position_z',
        'nx,ny,nz,X,Y,Z',
        'vx,vy,vz,pos.x,pos.y,pos.z',
        'a,b,c,field.x,field.y,field.z',
        'Ori_x,Ori_y,Ori_z,X,Y,Z',
        'a,b,c,X-Koordinate,Y-Koordinate,Z-Koordinate',
        'a,b,c,x_coord,y_coord,z_coord',
        'Rechts,hoch,c,Rechtswert,Hochwert,Höhe',
    ],
)
def test_names_of_other_programs_are_known(tmp_path, points, names):
    rows = rows_of(points, ',', [number, grey, grey])
    assert_reads(written(tmp_path / 'scan.csv', rows, names + '\n'), points)


def test_names_in_the_encoding_of_excel_are_known(tmp_path, points):
    rows = [row.replace('.', ',') for row in rows_of(points, ';')]
    head = 'sep=;\r\nRechtswert;Hochwert;Höhe\r\n'
    assert_reads(written(tmp_path / 'scan.csv', rows, head, encoding='cp1252'), points)


@pytest.mark.parametrize(
    'names', ['intensity,laser_id,azimuth', 'lat,lon,alt', 'xyz1,xyz2,xyz3', 'a,x,y']
)
def test_a_header_that_names_no_x_y_z_is_listed_with_the_option(tmp_path, points, names):
    path = written(tmp_path / 'scan.csv', rows_of(points), names + '\n')
    with pytest.raises(UnreadableCloud) as refused:
        read_cloud(path)
    assert all(repr(name) in str(refused.value) for name in names.split(','))
    assert '--columns' in str(refused.value)
    assert_reads(path, points, tuple(names.split(',')))
    assert_reads(path, points[:, ::-1], (3, 2, 1))


def test_two_columns_of_a_name_are_refused(tmp_path, points):
    path = written(tmp_path / 'scan.csv', rows_of(points, after=[grey]), 'x,y,z,x\n')
    with pytest.raises(UnreadableCloud, match="'x', 'y', 'z', 'x'"):
        read_cloud(path)


def test_which_columns_were_guessed_is_said(tmp_path, points, caplog):
    assert_reads(written(tmp_path / 'three.xyz', rows_of(points, ' ')), points)
    assert caplog.text == ''
    with caplog.at_level(logging.WARNING):
        assert_reads(written(tmp_path / 'four.xyz', rows_of(points, ' ', after=[grey])), points)
    assert 'the first three are taken' in caplog.text


def test_a_first_column_that_counts_rows_is_not_taken_for_x(tmp_path, points):
    path = written(tmp_path / 'scan.txt', rows_of(points, ' ', [number]))
    with pytest.raises(UnreadableCloud, match='counts rows; --columns says'):
        read_cloud(path)
    assert_reads(path, points, (2, 3, 4))


@pytest.mark.parametrize('suffix', ['.txt', '.xyz', '.pts', '.asc', '.csv'])
@pytest.mark.parametrize('head', ['60\n', '//X Y Z I R G B\n60\n', '60\n//X Y Z I R G B\n'])
def test_a_line_with_the_number_of_points_is_none(tmp_path, points, suffix, head):
    rows = rows_of(points, ' ', after=[grey] * 4)
    assert_reads(written(tmp_path / f'scan{suffix}', rows, head), points)


def test_pts_of_several_scans_are_put_together(tmp_path, points):
    rows = [*rows_of(points[:25], ' '), '35', *rows_of(points[25:], ' ')]
    assert_reads(written(tmp_path / 'scan.pts', rows, '25\n'), points)


def test_fewer_points_than_the_first_line_says_are_cut_off(tmp_path, points):
    path = written(tmp_path / 'scan.pts', rows_of(points, ' '), '61\n')
    with pytest.raises(UnreadableCloud, match='line 1 says 61 points and 60 follow'):
        read_cloud(path)


@pytest.mark.parametrize(
    ('head', 'words'),
    [
        ('Scanner: X\nDate: 2020-01-01\n', r"line 2 \('Date: 2020-01-01'\) is no point"),
        ('x,y,z\nm,m,m\n', r"line 2 \('m,m,m'\) is no point"),
        ('x,y,z\n1,2\n', r"line 2 \('1,2'\) holds 2 cells, where others hold 3"),
        ('x,y,z\n1,2,3,4\n', r"line 2 \('1,2,3,4'\) holds 4 cells"),
        ('x,y,z\n1,b,3\n', r"line 2 \('1,b,3'\) is no point: 'b' is no number"),
        ('x,y\n', r'names 2 columns, and line 2 .* holds 3'),
    ],
)
def test_a_line_that_is_no_point_is_named(tmp_path, points, head, words):
    path = written(tmp_path / 'scan.csv', rows_of(points), head)
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(path)


@pytest.mark.parametrize('encoding', ['utf-8-sig', 'utf-16', 'utf-8'])
@pytest.mark.parametrize('between', [',', '\t', ';'])
def test_delimiters_at_the_end_and_marks_at_the_beginning_are_none(
    tmp_path, points, encoding, between
):
    rows = [row + between for row in rows_of(points, between)]
    for name, head in (('a', 'x,y,z\n'), ('b', 'x,y,z,\n'), ('c', '')):
        head = head.replace(',', between)
        assert_reads(written(tmp_path / f'{name}.csv', rows, head, encoding), points)


def test_empty_cells_stay_cells_and_their_points_are_counted(tmp_path, points, caplog):
    rows = [*rows_of(points, after=[grey]), '1,,3,4', ',,,', '1,2,3,']
    read = read_cloud(written(tmp_path / 'scan.csv', rows, 'x,y,z,i\n'))
    np.testing.assert_array_equal(read, [*points, (1, 2, 3)])
    assert 'of 63 points 2 are not finite' in caplog.text


def test_a_quotation_mark_that_stays_open_is_refused(tmp_path):
    (tmp_path / 'scan.csv').write_text('x,y,z,name\n1,2,3,"a\n4,5,6,b"\n7,8,9,c\n')
    with pytest.raises(UnreadableCloud, match='quotation|cells'):
        read_cloud(tmp_path / 'scan.csv')


def test_cells_may_hold_blanks_and_rows_a_note(tmp_path, points):
    rows = [f'2020-01-01 12:00\t{row}\t#ff0000' for row in rows_of(points, '\t')]
    rows[3] += ' # seen twice'
    assert_reads(written(tmp_path / 'scan.csv', rows, 'time\tx\ty\tz\tcolour\n'), points)


def test_a_word_in_a_row_makes_it_no_header(tmp_path, points):
    rows = rows_of(points, ',', after=[lambda i: 'tree top'])
    assert_reads(written(tmp_path / 'scan.csv', rows), points)


def test_a_minus_as_typographers_write_it_is_one(tmp_path, points):
    rows = [row.replace('-', '\N{MINUS SIGN}') for row in rows_of(points, ';')]
    assert_reads(written(tmp_path / 'scan.csv', rows, 'x;y;z\n'), points)


def test_every_digit_is_kept(tmp_path, rng):
    points = rng.normal(size=(50, 3)) + (431_234.5, 5_412_345.6, 312.0)
    np.savetxt(tmp_path / 'scan.txt', points)
    assert_reads(tmp_path / 'scan.txt', points)
