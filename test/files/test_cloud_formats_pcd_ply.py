"""Layouts of PCD and PLY that real tools write."""

import struct

import numpy as np
import pytest
from plyfile import PlyData, PlyElement

from idem_ros.files.cloud_file import UnreadableCloud, read_cloud

PCD = """VERSION .7
FIELDS x y z timestamp intensity
SIZE 4 4 4 8 1
TYPE F F F F U
COUNT 1 1 1 1 1
WIDTH 40
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 40
DATA ascii
"""


@pytest.fixture
def points(rng):
    return (rng.normal(size=(40, 3)) * 7).astype(np.float32).astype(np.float64)


def assert_reads(path, points, columns=None):
    np.testing.assert_array_equal(read_cloud(path, columns), points)


@pytest.mark.parametrize(
    'row',
    [
        '{} {} {} 25.5 14\n',
        '{} {} {} 25.5 14 \n',
        '{}\t{}\t{}\t25.5\t14\r',
        '  {}  {} {} 2.5 1\r\n',
    ],
)
@pytest.mark.parametrize('kind', ['F F F F U', 'f f f f u'])
def test_ascii_pcd_is_split_at_any_white_space(tmp_path, points, row, kind):
    body = ''.join(row.format(*map(repr, map(float, point))) for point in points)
    (tmp_path / 'a.pcd').write_bytes((PCD.replace('F F F F U', kind) + body).encode())
    assert_reads(tmp_path / 'a.pcd', points)


def pcd(points=40, *, drop=(), **lines):
    """The header of a binary PCD of x y z; `lines` replace, `drop` leaves out."""
    given = {
        'VERSION': '0.7', 'FIELDS': 'x y z', 'SIZE': '4 4 4', 'TYPE': 'F F F', 'COUNT': '1 1 1',
        'WIDTH': points, 'HEIGHT': 1, 'VIEWPOINT': '0 0 0 1 0 0 0', 'POINTS': points,
        'DATA': 'binary', **lines,
    }  # fmt: skip
    given['DATA'] = given.pop('DATA')
    return ''.join(f'{k} {v}\n' for k, v in given.items() if k not in drop).encode()


@pytest.mark.parametrize(
    'header',
    [
        pcd(drop=['COUNT']),
        pcd(drop=['POINTS']),
        pcd(drop=['WIDTH', 'HEIGHT']),
        pcd(drop=['VIEWPOINT', 'VERSION']),
        pcd(VIEWPOINT='0 0 0 1'),
        pcd(drop=['FIELDS'], COLUMNS='x y z'),
        pcd(FIELDS='X Y Z'),
        pcd(WIDTH=8, HEIGHT=5),
        b'# .PCD v.7 - Point Cloud Data file format\n\n' + pcd(),
        b'\xef\xbb\xbf' + pcd(),
        pcd().replace(b'\n', b'\r\n'),
        pcd(DATA='BINARY'),
    ],
)
def test_what_a_pcd_header_leaves_out_is_as_the_format_says(tmp_path, points, header):
    (tmp_path / 'a.pcd').write_bytes(header + points.astype('<f4').tobytes())
    assert_reads(tmp_path / 'a.pcd', points)


def test_pcd_fields_of_count_0_and_of_bytes_are_passed_over(tmp_path, points):
    dtype = [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('_', 'u1', 4), ('i', '<f4'), ('r', '<u4')]
    table = np.zeros(40, dtype)
    for axis, name in enumerate('xyz'):
        table[name] = points[:, axis]
    header = pcd(
        FIELDS='x y z _ intensity _ range', SIZE='4 4 4 1 4 1 4', TYPE='F F F U F U U',
        COUNT='1 1 1 4 1 0 1',
    )  # fmt: skip
    (tmp_path / 'a.pcd').write_bytes(header + table.tobytes())
    assert_reads(tmp_path / 'a.pcd', points)


@pytest.mark.parametrize(
    ('header', 'words'),
    [
        (pcd(FIELDS='x y z class', COUNT='1 1 1 1'), 'SIZE has 3 entries, FIELDS 4'),
        (pcd(COUNT='1 1 2000000000'), '8000000008 bytes a point'),
        (pcd(COUNT='1 1 99999999999999999999'), 'COUNT is .* must be whole numbers'),
        (pcd(2_000_000_000), '40 points where the header says 2000000000'),
        (pcd(30), '40 points where the header says 30'),
        (pcd(WIDTH=41), 'POINTS is 40, WIDTH x HEIGHT is 41'),
        (pcd(TYPE='F F G'), "TYPE 'G' and SIZE 4"),
        (pcd(SIZE='4 4 3'), 'SIZE 3'),
        (pcd(SIZE='4 4 -4'), 'must be whole numbers'),
        (pcd(FIELDS='x y t'), "columns are 'x', 'y', 't'"),
        (pcd(DATA='zip'), "DATA is 'zip'"),
        (pcd(drop=['DATA']), 'no line DATA'),
        (pcd(drop=['FIELDS']), 'no FIELDS'),
        (b'FIELDS x\n' + pcd(), 'two lines FIELDS'),
        (pcd(0), 'holds 0 points'),
        (b'', 'it is empty'),
    ],
)
def test_what_is_wrong_with_a_pcd_is_said_in_words_of_pcd(tmp_path, points, header, words):
    (tmp_path / 'a.pcd').write_bytes(header + (points.astype('<f4').tobytes() if header else b''))
    with pytest.raises(UnreadableCloud, match=words) as refused:
        read_cloud(tmp_path / 'a.pcd')
    assert 'pydantic' not in str(refused.value)


@pytest.mark.parametrize(('packed', 'inflated'), [(20, 480), (2**32 - 1, 480), (20, 2**32 - 1)])
def test_a_compressed_pcd_is_held_against_its_size_before_it_is_inflated(
    tmp_path, packed, inflated
):
    header = pcd(inflated // 12, DATA='binary_compressed')
    body = struct.pack('<II', packed, inflated) + bytes(range(20))
    (tmp_path / 'a.pcd').write_bytes(header + body)
    with pytest.raises(UnreadableCloud):
        read_cloud(tmp_path / 'a.pcd')


PLY = """ply
format ascii 1.0
element vertex 40
property float x
property float y
property float z
end_header
"""
TWICE = 'element b 0\nproperty float x\nproperty float y\nproperty float z\n'


def ply(points, header=PLY, row='{} {} {}\n', encoding='utf-8'):
    body = ''.join(row.format(*map(repr, map(float, point))) for point in points)
    return (header + body).encode(encoding)


@pytest.mark.parametrize(
    ('header', 'row'),
    [
        (PLY + '\ufeff', '{} {} {}\n'),
        ('\ufeff' + PLY, '{} {} {}\n'),
        (PLY, '{} {} {} \n\n'),
        (PLY.replace('float x', 'float X').replace('float y', 'double Y'), '{} {} {}\n'),
        (PLY.replace('vertex', 'point'), '{} {} {}\n'),
        (PLY.replace('vertex', 'Vertex'), '{} {} {}\n'),
        (PLY.replace('element', 'bye\nobj_info num_cols 483\ncomment a\nelement'), '{} {} {}\n'),
        (
            PLY.replace('end_h', 'property list uint uchar _\n' * 2 + 'end_h'),
            '{} {} {} 4 0 0 0 0 2 0 0\n',
        ),
        (PLY.replace('end_h', 'property int a\nproperty uchar a\nend_h'), '{} {} {} 1 2\n'),
        (PLY.replace('end_h', 'element face 1\nproperty list uchar int i\nend_h'), '{} {} {}\n'),
    ],
)
def test_ply_is_read_whatever_its_names_and_marks(tmp_path, points, header, row):
    content = ply(points, header, row) + b'3 0 1 2\n' * header.count('face')
    (tmp_path / 'a.ply').write_bytes(content)
    assert_reads(tmp_path / 'a.ply', points)


def test_big_endian_ply_with_faces_before_the_points(tmp_path, points):
    table = np.rec.fromarrays(points.T.astype('>f4'), names=['x', 'y', 'z'])
    face = np.empty(3, [('i', 'O')])
    face['i'] = [np.arange(k, dtype='i4') for k in (3, 0, 4)]
    elements = [PlyElement.describe(face, 'face'), PlyElement.describe(np.array(table), 'vertex')]
    PlyData(elements, byte_order='>').write(tmp_path / 'a.ply')
    assert_reads(tmp_path / 'a.ply', points)


@pytest.mark.parametrize(
    ('header', 'words'),
    [
        (
            PLY.replace('vertex 40', 'vertex 2000000000'),
            'declares 2000000000 lines or more, and 40',
        ),
        (PLY.replace('vertex 40', 'vertex 30'), 'declares 30 lines, and 40 follow'),
        (PLY.replace('ascii', 'binary_little_endian').replace('40', '9999'), 'declares 119988'),
        (PLY.replace('float x', 'float a'), "element vertex|columns are 'a', 'y', 'z'"),
        (PLY.replace('float z', 'float z\nproperty float x'), "columns are 'x', 'y', 'z', 'x'"),
        (PLY.replace('end_h', 'property float t\nend_h'), "element 'vertex': row 0: property 't'"),
        (PLY.replace('float x', 'real x'), "has a line 'property real x', which PLY has not"),
        (PLY.replace('vertex 40', 'vertex -4'), 'must say name and count'),
        (PLY.replace('vertex', 'a').replace('end_h', TWICE + 'end_h'), "it has: 'a', 'b'"),
        (PLY.replace('format ascii 1.0\n', ''), 'no line format'),
        (PLY.replace('ascii', 'text'), 'its format is'),
        (PLY.replace('end_header', 'end'), 'no line end_header'),
        ('obj\n', 'no line end_header|does not begin'),
    ],
)
def test_what_is_wrong_with_a_ply_is_said(tmp_path, points, header, words):
    (tmp_path / 'a.ply').write_bytes(ply(points, header))
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(tmp_path / 'a.ply')
