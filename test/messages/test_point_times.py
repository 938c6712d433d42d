from types import SimpleNamespace

import numpy as np
import pytest
from spinning import STAMP, sweep

from idem_ros.messages.point_times import NoTimes, time_fields, times_of

AUTO = SimpleNamespace(unit='auto', stamp_at='auto')
SENSORS = {  # what drivers publish: field, values of times after the begin, where the stamp is
    'Velodyne': ('time', lambda t: (t - t.max()).astype('f4'), 'end'),
    'Velodyne, stamped at its first packet': ('time', lambda t: t.astype('f4'), 'begin'),
    'Ouster': ('t', lambda t: (t * 1e9).astype('u4'), 'begin'),
    'Hesai': ('timestamp', lambda t: t + STAMP / 1e9, 'begin'),
    'RoboSense': ('timestamp', lambda t: t - t.max() + STAMP / 1e9, 'end'),
    'Livox': ('timestamp', lambda t: ((t * 1e9).astype('i8') + STAMP).astype('f8'), 'begin'),
    'Livox custom': ('offset_time', lambda t: (t * 1e9).astype('u4'), 'begin'),
    'Autoware': ('time_stamp', lambda t: (t * 1e9).astype('u4'), 'begin'),
    'Aeva': ('time_offset_ns', lambda t: (t * 1e9).astype('i4'), 'begin'),
    'Blickfeld': ('point_time_offset', lambda t: (t * 1e9).astype('u4'), 'begin'),
    'microseconds': ('t_us', lambda t: (t * 1e6).astype('u4'), 'begin'),
    'microseconds of another name': ('time', lambda t: (t * 1e6).astype('f4'), 'begin'),
    'milliseconds': ('time', lambda t: (t * 1e3).astype('f4'), 'begin'),
    'big endian': ('t', lambda t: (t * 1e9).astype('>u4'), 'begin'),
    'nanoseconds of an epoch': (
        'timestamp',
        lambda t: (t * 1e9).astype('u8') + np.uint64(STAMP),
        'begin',
    ),
}


@pytest.mark.parametrize('order', ['rows', 'columns', 'shuffled'])
@pytest.mark.parametrize('sensor', SENSORS)
def test_the_times_of_every_driver_are_seconds_from_the_stamp(sensor, order):
    name, values, stamp_at = SENSORS[sensor]
    points, after_begin = sweep(order)
    times, said = times_of(values(after_begin), name, points, STAMP, AUTO)
    expected = after_begin - (after_begin.max() if stamp_at == 'end' else 0.0)
    np.testing.assert_allclose(times, expected, atol=2e-6)
    assert f'the stamp is at their {stamp_at}' in said
    assert name in said


@pytest.mark.parametrize(
    ('name', 'values', 'why'),
    [
        ('time', lambda t: 0.0 * t, 'are the same, 0'),
        ('timestamp', lambda t: (t + STAMP / 1e9).astype('f4'), 'are the same'),
        ('time', lambda t: np.where(t > 0.05, np.nan, t), 'are not finite'),
        ('time', lambda t: np.where(t > 0.05, np.inf, t), 'are not finite'),
        ('time', lambda t: 20.0 * t, 'last 1.99 s in s'),
        ('time', lambda t: 100.0 * t, 'last 9.97 s in s'),
        ('t', lambda t: (20.0 * t * 1e9).astype('u4'), 'last 1.99 s in ns'),
        ('timestamp', lambda t: t + STAMP / 1e9 + 5.0, 'of another sweep, or by another clock: 5'),
        ('time', lambda t: t + 0.2, 'of another sweep'),
        ('time', lambda t: t - 0.3, 'of another sweep'),
        ('time', lambda t: np.random.default_rng(1).permutation(t), 'in no order'),
        ('t', lambda t: ((t - 0.05) * 1e9).astype('i8').astype('u4'), 'roll over'),
        ('timestamp', lambda t: (t + 86399.95) % 86400.0, 'roll over'),
        ('time', lambda t: (t + 0.95) % 1.0, 'roll over'),
        ('t', lambda t: ((t + 0.95) * 1e9 % 1e9).astype('u4'), 'roll over'),
        ('t', lambda t: (40.0 * t).astype('u1'), 'is no sweep of'),
        ('time', lambda t: 1e-6 * t, 'is no sweep of'),
        ('time', lambda t: t.astype(str), 'type'),
    ],
)
def test_what_is_no_time_of_the_sweep_is_refused_and_why_is_said(name, values, why):
    points, after_begin = sweep()
    with pytest.raises(NoTimes, match=why):
        times_of(values(after_begin), name, points, STAMP, AUTO)


def test_a_unit_and_a_place_of_the_stamp_that_are_set_are_not_inferred():
    points, after_begin = sweep()
    rule = SimpleNamespace(unit='ms', stamp_at='middle')
    times, said = times_of(1e3 * after_begin + 777.0, 'anything', points, STAMP, rule)
    middle = after_begin.max() / 2
    np.testing.assert_allclose(times, after_begin - middle, atol=1e-12)
    assert 'in ms' in said
    assert 'point_time.stamp_at middle' in said


def test_times_around_the_stamp_are_told_from_those_of_another_sweep():
    points, after_begin = sweep()
    times, said = times_of(after_begin - 0.13, 'time', points, STAMP, AUTO)
    np.testing.assert_allclose(times, after_begin - 0.13)
    assert 'beside' in said


def test_a_small_stamp_of_a_simulated_clock_makes_no_relative_time_absolute():
    points, after_begin = sweep()
    times, _ = times_of(after_begin, 'time', points, 50_000_000, AUTO)
    np.testing.assert_allclose(times, after_begin)


def test_absolute_times_of_a_cloud_without_a_stamp_count_from_their_begin():
    points, after_begin = sweep()
    times, _ = times_of(after_begin + 1.7e9, 'timestamp', points, 0, AUTO)
    np.testing.assert_allclose(times, after_begin, atol=1e-6)


def test_a_sweep_of_which_the_middle_saw_nothing_is_one():
    points, after_begin = sweep()
    seen = (after_begin < 0.02) | (after_begin > 0.08)
    times, _ = times_of(after_begin[seen], 'time', points[seen], STAMP, AUTO)
    np.testing.assert_allclose(times, after_begin[seen])


def test_fields_of_times_are_found_by_the_names_that_drivers_use():
    names = ['x', 'Timestamp', 'y', 'z', 't']
    assert time_fields(names) == [4, 1]
    assert time_fields(names, 'Timestamp') == [1]
    assert time_fields(['x', 'y', 'z', 'intensity']) == []


@pytest.mark.parametrize('dtype', ['i1', 'u1', 'i2', 'u2', 'i4', 'u4', 'i8', 'u8', 'f4', 'f8'])
@pytest.mark.filterwarnings('error')
def test_whatever_bytes_a_field_holds_they_are_times_of_a_sweep_or_refused(dtype):
    rng = np.random.default_rng(2)
    for count in [1, 2, 3, 60] * 25:
        values = np.frombuffer(rng.bytes(count * int(dtype[1])), dtype)
        unit = rng.choice(['auto', 's', 'ns'])
        rule = SimpleNamespace(unit=unit, stamp_at=rng.choice(['auto', 'end']))
        try:
            times, _ = times_of(values, 'time', rng.normal(size=(count, 3)), STAMP, rule)
        except NoTimes:
            continue
        assert np.isfinite(times).all()
        assert np.ptp(times) <= 1.0
