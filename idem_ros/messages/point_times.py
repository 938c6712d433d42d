"""When each point was measured: the values of a field as seconds after a cloud's stamp.

The unit is what drivers mean by the field's name where the sweep then lasts 8 ms to a minute, else
the one of s, ms, us and ns in which it lasts 8 ms to a second. The values count from the stamp
where the sweep then reaches to within half of itself of the stamp, else from where the stamp
counts from. Whatever contradicts that is no time, and it is said why.
"""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.exceptions import IdemError

AUTO = 'auto'
NO_FIELD = 'it has no field of times'
NANOSECONDS = {'s': 10**9, 'ms': 10**6, 'us': 10**3, 'ns': 1}
# {field: unit}, as drivers have them; the first that is there and of use is taken
USUAL_UNIT = {
    't': 'ns',
    'time': 's',
    'timestamp': 's',
    'offset_time': 'ns',
    'time_stamp': 'ns',
    't_us': 'us',
    'stamps': 's',
    'time_offset': 'ns',
    'time_offset_ns': 'ns',
    'point_time_offset': 'ns',
}
STAMP_AT = {'begin': 0.0, 'middle': -0.5, 'end': -1.0}  # where a sweep begins, in sweeps
SHORTEST, LONGEST = 0.008, 1.0  # [s] of a sweep; in two units at once none lasts so long
LONG = 0.5  # [s] of a sweep: one that is seen in so long, and not in half of it, is none
PLAUSIBLE = 60.0  # [s] up to there a unit that is usual is meant, and the cloud is no sweep
REACH = 0.5  # of a sweep: how far from it its stamp may be
LEAP = 0.5  # of all that they span: times with such a gap roll over, or are of two sweeps
DISORDER = 0.1  # of a sweep: mean step from point to point; by chance it is a third
BINS, LEAST_OF_BIN = 64, 20
SAMPLE = 10_000  # points that directions are taken of
SCATTER = 0.8  # of directions at one instant over that of all; 1: by chance
TURN = 2.0 * np.pi
SMALL = np.radians(20.0)  # a step from point to point; larger ones lead to the next ring
CHANCE = np.radians(45.0)  # mean step; of points in any order it is 90 degrees
LEAST_TURN = 0.1  # turns, that neighbours make in all
ONE_TURN = 1.25  # turns, more than a sweep makes


class NoTimes(IdemError):
    """Values that are no times of a sweep; it says why."""


class TimesRead(NamedTuple):
    """The times of a cloud's points, and what is to be said of them."""

    times: NDArray[np.float64] | None
    """(N,), in seconds after the stamp; None: there are none that can be used."""
    said: str
    """How they were read, the same words for every cloud of a stream; or why there are none."""


def time_fields(names, wanted=''):
    """Return the indices of the names that may be of times, the likeliest first.

    Args:
        names: of all fields.
        wanted: the only one that may; empty: as drivers call theirs.
    """
    known = [wanted] if wanted else list(USUAL_UNIT)
    plain = [str(name) if wanted else str(name).lower() for name in names]
    return [i for each in known for i, name in enumerate(plain) if name == each]


def first_times(finders, wanted=''):
    """Return the `TimesRead` of the first finder that finds times; else why the first does not.

    Args:
        finders: each returns (times, how they were read), or raises `NoTimes`.
        wanted: the field that was asked for; empty: any.
    """
    reasons = []
    for find in finders:
        try:
            return TimesRead(*find())
        except NoTimes as error:
            reasons.append(str(error))
    none = f'it has no field {wanted}' if wanted else NO_FIELD
    return TimesRead(None, reasons[0] if reasons else none)


def times_of(values, name, points, stamp, rule):
    """Return the times of points by the values of a field of theirs.

    Args:
        values: (N,) numbers of any type, N >= 1.
        name: of the field.
        points: (N, 3), in the sensor's frame.
        stamp: of the cloud [ns]; 0: it has none.
        rule: has `unit` and `stamp_at`, see `PointTimeConfig`.

    Returns:
        (N,) seconds after the stamp, and how they were read.

    Raises:
        NoTimes: they are none.
    """
    try:
        return _times_of(values, name, points, stamp, rule)
    except NoTimes as error:
        raise NoTimes(f'field {name}: {error}') from error


def _times_of(values, name, points, stamp, rule):
    if values.dtype.kind not in 'fiu':
        raise NoTimes(f'they are of type {values.dtype}')
    values = values.astype(values.dtype.newbyteorder('='), copy=False)
    if values.dtype.kind == 'f' and (bad := int((~np.isfinite(values)).sum())):
        raise NoTimes(f'{bad} of {len(values)} are not finite')
    low, high = (Fraction(each.item()) for each in (values.min(), values.max()))
    if low == high:
        raise NoTimes(f'all {len(values)} are the same, {float(low):.10g}')
    unit = _unit(values, name, _float(high - low)) if rule.unit == AUTO else rule.unit
    span = _float((high - low) * NANOSECONDS[unit] / 10**9)
    if span > LONGEST:
        why = (
            'they roll over, or are of two sweeps' if _leaps(values) else 'no sweep lasts so long'
        )
        raise NoTimes(f'they last {span:.3g} s in {unit}: {why}')
    if span > LONG and _leaps(values):
        raise NoTimes(f'they leap within {span:.3g} s: they roll over, or are of two sweeps')
    begin, since = _begin(low * NANOSECONDS[unit], span, stamp, rule)
    times = _from_low(values, values.min()) * (NANOSECONDS[unit] / 1e9) + begin
    require_order(times, span, points)
    said = f'field {name} ({values.dtype}) in {unit}, {since}; {_place(begin, span)}'
    return times, said


def _unit(values, name, span):
    lasts = {unit: span * each / 1e9 for unit, each in NANOSECONDS.items()}
    usual = USUAL_UNIT.get(name.lower())
    if usual and SHORTEST <= lasts[usual] <= PLAUSIBLE:
        return usual
    for unit, duration in lasts.items():
        if SHORTEST <= duration <= LONGEST:
            if _leaps(values):
                raise NoTimes(f'they leap within {span:.4g}: they roll over, or are of two sweeps')
            return unit
    raise NoTimes(
        f'they span {span:.4g}, which in s, ms, us and ns is no sweep of {SHORTEST:g} to '
        f'{LONGEST:g} s; point_time.unit says what they are in'
    )


def _leaps(values):
    """Whether values leave out more than half of what they span, in one piece."""
    after_low = _from_low(values, values.min())
    share = after_low / after_low.max()
    filled = np.flatnonzero(np.bincount((share * (BINS - 1)).astype(np.int64)))
    return len(values) > LEAST_OF_BIN and np.diff(filled).max() > LEAP * BINS


def _begin(low, span, stamp, rule):
    """Return when a sweep begins [s after the stamp], and what its values count from.

    low: the first [ns], in the field's own count; a `Fraction`.
    """
    if rule.stamp_at != AUTO:
        return STAMP_AT[rule.stamp_at] * span, f'by point_time.stamp_at {rule.stamp_at}'
    relative, absolute = _float(low / 10**9), _float((low - stamp) / 10**9)
    if _gap(relative, span) <= REACH * span:
        return relative, 'counted from the stamp'
    if not stamp:
        return 0.0, 'absolute, without a stamp'
    if (gap := _gap(absolute, span)) <= REACH * span:
        return absolute, 'absolute'
    gap = min(gap, _gap(relative, span))
    raise NoTimes(
        f'they are of another sweep, or by another clock: {gap:.3g} s from the stamp; '
        'point_time.stamp_at says which of them the stamp is'
    )


def _gap(begin, span):
    """Return how far [s] a sweep is from its stamp."""
    return max(begin, -(begin + span), 0.0)


def _place(begin, span):
    at = min(STAMP_AT, key=lambda place: abs(STAMP_AT[place] * span - begin))
    is_there = abs(STAMP_AT[at] * span - begin) < 0.1 * span
    return f'the stamp is at their {at}' if is_there else 'the stamp is beside their begin and end'


def _from_low(values, low):
    """Return how far values are from the lowest, exactly for whole numbers of any size."""
    if values.dtype.kind == 'f' or values.dtype.itemsize < 8:
        return values.astype(np.float64) - float(low)
    # modulo 2^64, where no difference overflows
    return (values.view(np.uint64) - low.view(np.uint64)).astype(np.float64)


def _float(number):
    """Return a `Fraction` as a float, be it infinite."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def require_order(times, span, points):
    """Refuse times that are not of the points beside them.

    Sensors store points as they measure them, or row after row; filters may shuffle both. Where
    neighbours in a cloud are at any times, the points of an instant must look one way.

    Raises:
        NoTimes: neither is so.
    """
    if len(times) < 2 * LEAST_OF_BIN or np.abs(np.diff(times)).mean() <= DISORDER * span:
        return
    if _scatter(times, points) > SCATTER:
        raise NoTimes(
            'they are in no order, and the points of an instant lie in every direction: they are '
            'not of these points'
        )


def _scatter(times, points):
    """Return how directions scatter at one instant over how all do; 1: as by chance."""
    every = max(len(times) // SAMPLE, 1)
    times, points = times[::every], points[::every]
    directions = points / np.maximum(np.linalg.norm(points, axis=1), 1e-300)[:, None]
    order = np.argsort(times, kind='stable')
    size = max(len(order) // BINS, LEAST_OF_BIN)
    count = len(order) // size
    if count < 2:
        return 0.0
    bins = directions[order[: count * size]].reshape(count, size, 3)
    within = 1.0 - (bins.mean(axis=1) ** 2).sum(axis=1)
    overall = 1.0 - float((directions.mean(axis=0) ** 2).sum())
    return float(within.mean()) * size / (size - 1) / max(overall, 1e-12)


def azimuth_times(points, rule):
    """Return the times of the points of a sensor that turns evenly about its z axis.

    They must be in the order of their azimuths, column after column or ring after ring: the first
    is of the sweep's begin, and the order tells which way the sensor turns.

    Args:
        points: (N, 3), in the sensor's frame.
        rule: has `turn`, what a whole turn lasts [s], and `stamp_at`; auto: begin.

    Returns:
        (N,) seconds after the stamp, and how they were found.

    Raises:
        NoTimes: they are in no such order.
    """
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    steps = (np.diff(azimuth) + np.pi) % TURN - np.pi
    sizes = np.abs(steps)
    turned = float(steps[sizes < SMALL].sum()) / TURN
    if len(steps) == 0 or sizes.mean() > CHANCE or abs(turned) < LEAST_TURN:
        raise NoTimes('its points are not in the order of their azimuths')
    way = np.sign(turned)
    progress = way * np.concatenate([[0.0], np.cumsum(steps)]) / TURN
    if np.ptp(progress) <= ONE_TURN:  # column after column, or no whole turn
        progress -= progress.min()
    else:
        margin = float(np.median(sizes))  # rings begin at nearly the same azimuth
        progress = ((way * (azimuth - azimuth[0]) + margin) % TURN - margin) / TURN
    times = rule.turn * progress
    at = 'begin' if rule.stamp_at == AUTO else rule.stamp_at
    which = 'counterclockwise' if way > 0 else 'clockwise'
    said = f'by azimuth, {which}, {rule.turn:g} s a turn; the stamp is at their {at}'
    return times + STAMP_AT[at] * float(np.ptp(times)), said
