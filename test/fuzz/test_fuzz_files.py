"""Any bytes, and any mutation of valid files, give a cloud or a pose, or an IdemError of one line.

IDEM_FUZZ=10000 asks for so many examples; some hundred without. The work is bounded by the bytes,
which is held by what is allocated: no clock is asked.
"""

import io
import logging
import os
import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plyfile import PlyData, PlyElement
from pypcd4 import Encoding, PointCloud

from idem_ros.core import IdemError
from idem_ros.files.cloud_file import READERS, read_cloud
from idem_ros.files.pose_file import read_pose
from idem_ros.files.trajectory_file import read_trajectory

EXAMPLES = int(os.environ.get('IDEM_FUZZ', '200'))
SMALL = 3_000_000  # [bytes] that the libraries take for a file of no size
many = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
some = settings(many, max_examples=max(EXAMPLES // 4, 50))
POINTS = np.round(np.random.default_rng(5).normal(size=(30, 3)) * 7, 3)
WORDS = [b'\n', b' ', b',', b';', b'\t', b'"', b'#', b'nan', b'-', b'.', b'1e999', b'0', b'\x00']
WORDS += [b'2000000000', b'99999999999999999999', b'-1', b'x', b'list', b'\xef\xbb\xbf', b'\xff']
WORDS += [
    b'property',
    b'element',
    b'COUNT',
    b'SIZE',
    b'end_header\n',
    b'DATA ascii\n',
    b'%',
    b'//',
]


def _ply(text):
    table = np.zeros(30, [('x', 'f4'), ('y', 'f4'), ('z', 'f4'), ('i', 'u1')])
    for axis, name in enumerate('xyz'):
        table[name] = POINTS[:, axis]
    face = np.empty(4, [('i', 'O')])
    face['i'] = [np.arange(k, dtype='i4') for k in (3, 0, 4, 2)]
    stream = io.BytesIO()
    elements = [PlyElement.describe(face, 'face'), PlyElement.describe(table, 'vertex')]
    PlyData(elements, text=text).write(stream)
    return stream.getvalue()


def _pcd(encoding):
    stream = io.BytesIO()
    PointCloud.from_xyzi_points(np.c_[POINTS, POINTS[:, 0]]).save(stream, encoding)
    return stream.getvalue()


def _npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def _npz(**arrays):
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def _ptx():
    head = '5\n6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n'
    return _text(' ', head)


def _text(between, head='', decimal='.'):
    rows = (between.join(f'{c:.3f}' for c in point) for point in POINTS)
    return (head + '\n'.join(rows).replace('.', decimal) + '\n').encode()


def _las(suffix):
    laspy = pytest.importorskip('laspy', reason='needs the extra survey')
    las = laspy.create(point_format=0, file_version='1.2')
    las.header.scales = (0.001,) * 3
    las.x, las.y, las.z = POINTS.T
    stream = io.BytesIO()
    las.write(stream, do_compress=suffix == '.laz')
    return stream.getvalue()


VALID = [
    *(('.ply', _ply(text)) for text in (True, False)),
    *(('.pcd', _pcd(each)) for each in Encoding),
    ('.npy', _npy(POINTS)),
    ('.npy', _npy(np.rec.fromarrays(POINTS.T, names=['x', 'y', 'z']))),
    ('.npz', _npz(points=POINTS, colors=POINTS)),
    ('.npz', _npz(x=POINTS[:, 0], y=POINTS[:, 1], z=POINTS[:, 2])),
    ('.ptx', _ptx()),
    ('.csv', _text(',', 'x,y,z\n')),
    ('.csv', _text(';', 'x;y;z\n', ',')),
    ('.pts', _text(' ', '30\n')),
    ('.txt', _text('\t', '# x y z\n', ',')),
    ('.bin', np.c_[POINTS, POINTS[:, 0] > 0].astype('<f4').tobytes()),
    ('.bin', np.c_[POINTS, POINTS[:, 0] > 0].tobytes()),
]
SURVEY = ('.las', '.laz')  # their libraries are not ours to fuzz by any mutation of a valid file


@st.composite
def mutated(draw, content):
    """Bytes with some replaced, inserted, doubled or left out."""
    content = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(content)))
        end = min(len(content), at + draw(st.integers(0, 12)))
        new = draw(st.one_of(st.sampled_from(WORDS), st.binary(max_size=8)))
        kind = draw(st.sampled_from(['replace', 'insert', 'cut', 'end', 'number', 'double']))
        if kind == 'replace':
            content[at:end] = new
        elif kind == 'insert':
            content[at:at] = new
        elif kind == 'cut':
            del content[at:end]
        elif kind == 'end':
            del content[at:]
        elif kind == 'number':
            content[at : at + 4] = struct.pack('<I', draw(st.integers(0, 2**32 - 1)))
        else:
            content[at:at] = content[at:end] * draw(st.integers(1, 40))
    return bytes(content)


@st.composite
def files(draw):
    """A suffix and bytes: of a valid file that was changed, or any."""
    if draw(st.integers(0, 9)):
        suffix, content = draw(st.sampled_from(VALID))
        return suffix, draw(mutated(content))
    return draw(st.sampled_from(list(READERS))), draw(st.binary(max_size=600))


def held_to_one_line(read, path):
    """Return what a reader returns; None where it refuses in one line that names the file."""
    said = ''
    try:
        return read(path)
    except IdemError as error:
        said = str(error)
    assert path.name in said
    assert '\n' not in said
    assert len(said) < 1000
    return None


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    logging.disable(logging.WARNING)
    path = tmp_path_factory.mktemp('fuzz')
    for k, (suffix, content) in enumerate(VALID):  # what libraries take when first used
        (path / f'{k}{suffix}').write_bytes(content)
        read_cloud(path / f'{k}{suffix}')
    yield path
    logging.disable(logging.NOTSET)


@many
@given(file=files(), columns=st.sampled_from([None, None, None, 4, (1, 2, 3), ('x', 'y', 'z')]))
def test_any_file_is_a_cloud_or_refused_in_one_line(folder, file, columns):
    suffix, content = file
    path = folder / f'scan{suffix}'
    path.write_bytes(content)
    points = held_to_one_line(lambda path: read_cloud(path, columns), path)
    assert points is None or (points.shape[1:] == (3,) and np.isfinite(points).all())


@some
@given(file=files())
def test_reading_allocates_no_more_than_the_bytes_ask_for(folder, file):
    suffix, content = file
    path = folder / f'scan{suffix}'
    path.write_bytes(content)
    tracemalloc.start()
    try:
        held_to_one_line(read_cloud, path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak <= SMALL + 300 * len(content)


@pytest.mark.parametrize('suffix', SURVEY)
@some
@given(changes=st.data())
def test_las_that_was_changed_is_a_cloud_or_refused(folder, suffix, changes):
    path = folder / f'scan{suffix}'
    path.write_bytes(changes.draw(mutated(_las(suffix))))
    held_to_one_line(read_cloud, path)


MATRIX = b'0 -1 0 1.5\n1 0 0 2\n0 0 1 -3\n0 0 0 1\n'
TUM = b'1.5 1 2 3 0 0 0 1\n2.5 2 2 3 0 0 0 1\n'
CSV = b'stamp,x,y,z,qx,qy,qz,qw\n1.5,1,2,3,0,0,0,1\n'


@many
@given(content=st.sampled_from([MATRIX, TUM, CSV]).flatmap(mutated) | st.binary(max_size=200))
def test_any_file_is_a_pose_or_a_trajectory_or_refused_in_one_line(folder, content):
    for name, read in (
        ('pose.txt', read_pose),
        ('t.txt', read_trajectory),
        ('t.csv', read_trajectory),
    ):
        path = folder / name
        path.write_bytes(content)
        held_to_one_line(read, path)
