import array
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from idem_ros.core import InvalidCloud
from idem_ros.messages.pointcloud2 import (
    FLOAT32,
    FLOAT64,
    InvalidPointCloud2,
    pack_points,
    read_points,
)

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 5.25, 1e3], [0.125, 0.0, -7.0], [9.0, 8.0, 0.5]])


def message(points=POINTS, **changes):
    """A plain PointCloud2 of float32 points, with some of its fields changed."""
    packed = pack_points(points)
    fields = {**vars(packed), 'fields': [field(*values) for values in packed.fields]}
    return SimpleNamespace(**{**fields, **changes})


def field(name, offset, datatype=FLOAT32, count=1):
    return SimpleNamespace(name=name, offset=offset, datatype=datatype, count=count)


def laid_out(points, dtypes, order, offsets, point_step, height=1, row_padding=0, byteorder='<'):
    """Lay points out by hand: field order and offsets, paddings, rows, byte order."""
    width = len(points) // height
    row_step = width * point_step + row_padding
    data = np.full(height * row_step, 0xA5, np.uint8)
    for i, point in enumerate(points):
        start = (i // width) * row_step + (i % width) * point_step
        for axis, dtype, offset in zip(range(3), dtypes, offsets, strict=True):
            value = np.array(point[axis], dtype=byteorder + dtype).tobytes()
            data[start + offset : start + offset + len(value)] = np.frombuffer(value, np.uint8)
    datatypes = {'f4': FLOAT32, 'f8': FLOAT64}
    fields = [field('xyz'[axis], offsets[axis], datatypes[dtypes[axis]]) for axis in order]
    fields.insert(1, field('intensity', 0, datatype=2))
    return SimpleNamespace(
        height=height,
        width=width,
        fields=fields,
        is_bigendian=byteorder == '>',
        point_step=point_step,
        row_step=row_step,
        data=data,
        is_dense=True,
    )


@st.composite
def layouts(draw):
    dtypes = [draw(st.sampled_from(['f4', 'f8'])) for _ in range(3)]
    placed = draw(st.permutations(range(3)))
    offsets, position = [0, 0, 0], draw(st.integers(0, 5))
    for axis in placed:
        offsets[axis] = position
        position += int(dtypes[axis][1]) + draw(st.integers(0, 5))
    return {
        'dtypes': dtypes,
        'order': draw(st.permutations(range(3))),
        'offsets': offsets,
        'point_step': position + draw(st.integers(0, 7)),
        'height': draw(st.sampled_from([1, 2, 4])),
        'row_padding': draw(st.integers(0, 9)),
        'byteorder': draw(st.sampled_from('<>')),
    }


@given(layouts())
def test_any_layout_gives_the_same_points(layout):
    read = read_points(laid_out(POINTS, **layout))
    np.testing.assert_array_equal(read.points, POINTS)
    assert (read.dropped_nonfinite, read.dropped_zero) == (0, 0)


@pytest.mark.parametrize('dtype', [np.float32, np.float64])
def test_packed_points_come_back(rng, dtype):
    points = rng.normal(size=(50, 3)).astype(dtype)
    packed = pack_points(points, dtype)
    fields = [field(*values) for values in packed.fields]
    read = read_points(SimpleNamespace(**{**vars(packed), 'fields': fields}))
    np.testing.assert_array_equal(read.points, points)
    assert packed.row_step == packed.width * packed.point_step == packed.data.size


def test_an_organised_cloud_is_read_row_by_row():
    points = np.arange(1.0, 19.0).reshape(6, 3)
    organised = laid_out(points, ['f4'] * 3, [0, 1, 2], [0, 4, 8], 16, height=2, row_padding=8)
    np.testing.assert_array_equal(read_points(organised).points, points)


def test_points_not_finite_or_exactly_zero_are_dropped_where_is_dense_lies():
    bad = [[np.nan, 1, 1], [1, np.inf, 1], [0, 0, 0], [-0.0, 0.0, 0.0], [1, 1, -np.inf]]
    read = read_points(message(np.concatenate([POINTS[:2], bad, POINTS[2:]]), is_dense=True))
    np.testing.assert_array_equal(read.points, POINTS)
    assert (read.dropped_nonfinite, read.dropped_zero) == (3, 2)


def test_points_far_from_all_the_rest_are_dropped_and_counted(rng):
    points = rng.uniform(-50.0, 50.0, (500, 3)).astype(np.float32)
    strays = [[1e9, 0.0, 0.0], [2e4, 2e4, 0.0]]
    read = read_points(message(np.concatenate([strays, points]), is_dense=True))
    np.testing.assert_array_equal(read.points, points)
    assert (read.dropped_nonfinite, read.dropped_zero, read.dropped_stray) == (0, 0, 2)


def test_what_is_seen_far_away_by_a_few_points_is_kept(rng):
    cage, street = rng.normal(0.0, 0.2, (600, 3)), rng.uniform(-100.0, 100.0, (400, 3))
    points = np.concatenate([cage, street])
    assert read_points(message(points)).dropped_stray == 0


def test_a_point_on_an_axis_is_kept():
    read = read_points(message(np.array([[0.0, 0.0, 1.0], [0.0, 2.0, 0.0]])))
    assert len(read.points) == 2


@pytest.mark.parametrize(
    'buffer', [bytes, bytearray, lambda data: array.array('B', data.tobytes()), memoryview]
)
def test_any_buffer_of_bytes_is_read_and_left_untouched(buffer):
    data = buffer(pack_points(POINTS).data)
    before = bytes(data)
    points = read_points(message(data=data)).points
    points += 1.0
    assert bytes(data) == before


def test_the_message_can_be_resized_after_reading():
    data = array.array('B', pack_points(POINTS).data.tobytes())
    read_points(message(data=data))
    data.append(0)  # a view that is kept would make this a BufferError


def test_a_row_step_of_zero_means_no_padding():
    np.testing.assert_array_equal(read_points(message(row_step=0)).points, POINTS)


X, Y, Z = field('x', 0), field('y', 4), field('z', 8)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'fields': []}, "no field 'x'; its fields: none"),
        ({'fields': [X, Y]}, "no field 'z'; its fields: x, y"),
        ({'fields': [X, X, Y, Z]}, "2 fields 'x'"),
        ({'fields': [X, Y, field('z', 8, datatype=5)]}, 'datatype 5'),
        ({'fields': [X, Y, field('z', 8, datatype=0)]}, 'datatype 0'),
        ({'fields': [X, Y, field('z', 9)]}, 'beyond point_step 12'),
        ({'fields': [X, Y, field('z', 8, datatype=FLOAT64)]}, 'beyond point_step 12'),
        ({'fields': [X, Y, field('z', -4)]}, 'offset -4'),
        ({'fields': [X, Y, field('z', 2**32 - 1)]}, 'beyond point_step 12'),
        ({'fields': [X, Y, field('z', 8, count=3)]}, 'count 3'),
        ({'fields': [X, Y, field('z', 6)]}, 'overlap'),
        ({'fields': [X, field('y', 0), Z]}, 'overlap'),
        ({'width': 5}, 'row_step 48 is too small for 5 points'),
        ({'width': 5, 'row_step': 60}, '48 bytes'),
        ({'width': 2**32 - 1, 'row_step': 0}, '48 bytes'),
        ({'height': 2**32 - 1}, '48 bytes'),
        ({'width': -4, 'height': -1}, 'negative'),
        ({'width': 0}, 'no points'),
        ({'height': 0}, 'no points'),
        ({'point_step': 0, 'row_step': 0}, 'data holds 48 bytes'),
        ({'point_step': 2**31}, 'too small'),
        ({'row_step': 47}, 'too small'),
        ({'data': pack_points(POINTS).data[:-1]}, '47 bytes'),
        ({'data': np.append(pack_points(POINTS).data, np.uint8(0))}, '49 bytes'),
        ({'data': b''}, '0 bytes'),
        ({'data': [1, 2, 3]}, 'not a buffer'),
        ({'data': None}, 'not a buffer'),
    ],
)
def test_a_message_that_contradicts_itself_is_refused_with_the_reason(changes, reason):
    with pytest.raises(InvalidPointCloud2) as refused:
        read_points(message(**changes))
    assert reason in str(refused.value)


def test_a_cloud_without_a_usable_point_is_refused_with_counts():
    points = np.array([[np.nan, 0, 0], [0, 0, 0], [0, 0, 0]])
    with pytest.raises(InvalidPointCloud2, match='none of its 3 .* 1 not finite, 2 exactly zero'):
        read_points(message(points))


def test_a_refused_message_is_an_invalid_cloud():
    assert issubclass(InvalidPointCloud2, InvalidCloud)


def test_points_of_zero_size_are_no_way_to_use_up_memory():
    empty = message(width=2**31, height=2**31, point_step=0, row_step=0, data=b'')
    with pytest.raises(InvalidPointCloud2):
        read_points(empty)


def test_reading_takes_less_than_ten_times_the_size_of_the_message(rng):
    points = rng.normal(size=(100_000, 3))
    points[::2] = 0.0
    cloud = message(points)
    tracemalloc.start()
    try:
        read_points(cloud)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10 * cloud.data.size


small = st.integers(-2, 40)
huge = st.sampled_from([2**16, 2**31, 2**32 - 1, 2**63])
size = st.one_of(small, huge)


@settings(max_examples=300)
@given(
    height=size,
    width=size,
    point_step=size,
    row_step=size,
    is_bigendian=st.booleans(),
    data=st.binary(max_size=200),
    fields=st.lists(
        st.builds(
            field,
            name=st.sampled_from(['x', 'y', 'z', 'rgb', '']),
            offset=size,
            datatype=st.integers(0, 9),
            count=st.integers(0, 3),
        ),
        max_size=6,
    ),
)
def test_no_message_does_anything_but_be_read_or_be_refused(**fields):
    try:
        read = read_points(SimpleNamespace(**fields, is_dense=False))
    except InvalidPointCloud2:
        return
    assert read.points.dtype == np.float64
    assert np.isfinite(read.points).all()
    lost = read.dropped_nonfinite + read.dropped_zero
    assert len(read.points) + lost == fields['height'] * fields['width']


@given(data=st.binary(min_size=36, max_size=36))
def test_no_bytes_but_finite_points_come_out(data):
    try:
        points = read_points(message(POINTS[:3], data=data)).points
    except InvalidPointCloud2:
        return
    assert np.isfinite(points).all()
