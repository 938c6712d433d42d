from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from spinning import STAMP, sweep

from idem_ros.messages.pointcloud2 import read_points
from idem_ros.refinement.point_time_config import PointTimeConfig

DATATYPES = {'i1': 1, 'u1': 2, 'i2': 3, 'u2': 4, 'i4': 5, 'u4': 6, 'f4': 7, 'f8': 8}
CONFIG = PointTimeConfig()


def message(points, byteorder='<', **columns):
    """A PointCloud2 of points and more fields, each of its own type, without padding."""
    columns = {**dict(zip('xyz', points.T.astype('f4'), strict=True)), **columns}
    types = [(name, byteorder + values.dtype.str[1:]) for name, values in columns.items()]
    table = np.empty(len(points), types)
    for name, values in columns.items():
        table[name] = values
    fields = [
        SimpleNamespace(name=name, offset=offset, datatype=DATATYPES[dtype.str[1:]], count=1)
        for name, (dtype, offset) in table.dtype.fields.items()
    ]
    stamp = SimpleNamespace(sec=STAMP // 10**9, nanosec=STAMP % 10**9)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp, frame_id='lidar'),
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=byteorder == '>',
        point_step=table.dtype.itemsize,
        row_step=table.nbytes,
        data=table.view('u1').reshape(-1),
        is_dense=True,
    )


@pytest.mark.parametrize('byteorder', ['<', '>'])
def test_points_that_are_dropped_take_their_times_with_them(byteorder):
    points, after_begin = sweep()
    points[::7], points[3::11] = np.nan, 0.0
    kept = np.isfinite(points).all(axis=1) & points.any(axis=1)
    times = np.where(kept, after_begin, 4e9)  # what is dropped may have any time
    read = read_points(message(points, byteorder, intensity=times, time=times), CONFIG)
    assert len(read.points) == kept.sum()
    np.testing.assert_allclose(read.times.times, after_begin[kept])


def test_times_are_read_where_they_are_asked_for_only():
    points, after_begin = sweep()
    read = read_points(message(points, time=after_begin))
    assert read.times == (None, '')
    read = read_points(message(points, time=after_begin), replace(CONFIG, origin='none'))
    assert read.times == (None, '')


def test_a_cloud_without_times_is_read_and_says_so():
    points, _ = sweep()
    assert read_points(message(points), CONFIG).times == (None, 'it has no field of times')
    named = replace(CONFIG, field='stamps')
    assert read_points(message(points), named).times.said == 'it has no field stamps'


def test_of_several_fields_the_first_that_can_be_used_is_taken():
    points, after_begin = sweep()
    read = read_points(
        message(points, t=np.zeros(len(points), 'u4'), timestamp=after_begin), CONFIG
    )
    np.testing.assert_allclose(read.times.times, after_begin)
    assert 'field timestamp (float64)' in read.times.said


def test_a_field_that_holds_several_numbers_holds_no_time():
    points, after_begin = sweep()
    timed = message(points, time=after_begin)
    timed.fields[-1].count = 2
    read = read_points(timed, CONFIG)
    assert read.times.times is None
    assert 'field time is not one number of each point' in read.times.said


def test_azimuths_give_times_where_nobody_else_does():
    points, after_begin = sweep('columns')
    read = read_points(message(points), PointTimeConfig(origin='azimuth'))
    np.testing.assert_allclose(read.times.times, after_begin, atol=1e-6)
