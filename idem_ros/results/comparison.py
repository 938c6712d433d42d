"""Two results of the same recording, frame against frame: is B better, worse, or who knows."""

from collections import Counter
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.results.result_file import COUNTS

MEASURES = {
    'translation_error_m': 'translation error [m]',
    'rotation_error_deg': 'rotation error [deg]',
    'q_tot': 'q_tot [nat]',
    'time_ms': 'time [ms]',
}
FEWEST = 6  # of fewer differences not even the range is a 95 % interval: 2 * 0.5^5 > 0.05
CONFIDENCE = 0.95


class IncomparableResults(IdemError):
    """Two results of different recordings, or that share too few frames."""


class Verdict(Enum):
    """What B is, compared with A."""

    BETTER = 'better'
    WORSE = 'worse'
    CANNOT_TELL = 'cannot tell'


@dataclass(frozen=True)
class Difference:
    """One measure of B less that of A; less is better in all of them."""

    measure: str
    frames: int
    """In which both have it."""
    median_a: float | None
    median_b: float | None
    median: float | None
    """Of the differences of the frames."""
    low: float | None
    high: float | None
    """95 % confidence interval of that median; None of fewer than six frames."""
    verdict: Verdict
    note: str
    """Why there is no interval, or fewer frames than are shared; else empty."""


@dataclass(frozen=True)
class Comparison:
    """What became of the frames of two results; every one of them is counted once."""

    shared: int
    only_a: int
    only_b: int
    differences: tuple[Difference, ...]


def compare(a, b):
    """Compare two `Result` by the frames that both have: sources of the same stamp.

    The interval is that of the sign test: between two of the sorted differences, exact for
    whatever distribution they have, symmetric or not. It takes the frames as independent.
    B is better where the whole interval is below zero, worse where it is above.

    Returns:
        `Comparison`

    Raises:
        IncomparableResults: they are of different recordings, or share fewer than six frames.
    """
    _require_same_recording(a, b)
    of_a, of_b = _by_stamp(a), _by_stamp(b)
    shared = [key for key in of_a if key in of_b]
    if len(shared) < FEWEST:
        raise IncomparableResults(
            f'{a.path} ({len(of_a)} frames) and {b.path} ({len(of_b)} frames) share '
            f'{len(shared) or "no"} stamps; a comparison needs {FEWEST} frames in both, of the '
            'same recording'
        )
    in_a, in_b = ([frames[key] for key in shared] for frames in (of_a, of_b))
    return Comparison(
        len(shared),
        len(of_a) - len(shared),
        len(of_b) - len(shared),
        tuple(_difference(measure, a, b, in_a, in_b) for measure in MEASURES),
    )


def tally(result):
    """Return {what: how many sources}: what became of those of a result, and their verdicts."""
    verdicts = Counter(frame.get('verdict') for frame in result.frames)
    judged = {f'verdict {name}': verdicts[name] for name in sorted(filter(None, verdicts))}
    unjudged = {'no verdict': verdicts[None]} if None in verdicts else {}
    return {name: result.counts[name] for name in COUNTS} | judged | unjudged


def differing_settings(a, b):
    """Return [(setting, of A, of B)] of what two `Result` were made with otherwise, as texts.

    Where `mode`, `method` or `sequence` is among them the two did not do the same: their
    errors are of different poses.
    """
    of_a, of_b = a.settings(), b.settings()
    names = [name for name in {**of_a, **of_b} if not name.startswith('input.')]
    rows = [(name, of_a.get(name, '-'), of_b.get(name, '-')) for name in names]
    return [row for row in rows if row[1] != row[2]] if of_a and of_b else []


def _require_same_recording(a, b):
    """Tell recordings apart by their checksums, and by their names where one is not known."""
    inputs = [(each.made_by or {}).get('input') or {} for each in (a, b)]
    sums = [each.get('sha256') for each in inputs]
    names = [
        each.get('name') or Path(result.bag).name
        for each, result in zip(inputs, (a, b), strict=True)
    ]
    is_known = all(sums)
    if (sums[0] != sums[1]) if is_known else (names[0] != names[1]):
        what = 'of another content' if is_known and names[0] == names[1] else f'of {names[1]}'
        raise IncomparableResults(
            f'{a.path} is of {names[0]} and {b.path} {what}; a comparison needs two results of '
            'the same recording'
        )


def _by_stamp(result):
    """Return {(stamp, how many before had it): index}: in a loop, stamps come again."""
    seen, frames = Counter(), {}
    for i, frame in enumerate(result.frames):
        stamp = frame['stamp_ns']
        frames[stamp, seen[stamp]] = i
        seen[stamp] += 1
    return frames


def _difference(measure, a, b, in_a, in_b):
    values_a, values_b = a.values(measure)[in_a], b.values(measure)[in_b]
    known, note = np.isfinite(values_a) & np.isfinite(values_b), ''
    if measure == 'q_tot':
        same = a.values('radius')[in_a] == b.values('radius')[in_b]
        if (known & ~same).any():
            note = f'{(known & ~same).sum()} frames left out: another radius, other units'
        known &= same
    values_a, values_b = values_a[known], values_b[known]
    if not known.any():
        note = note or 'not known in both'
        return Difference(measure, 0, *[None] * 5, Verdict.CANNOT_TELL, note)
    differences = values_b - values_a
    low, high = _interval(differences)
    if low is None:
        note = note or f'known in fewer than {FEWEST} frames'
    return Difference(
        measure,
        int(known.sum()),
        float(np.median(values_a)),
        float(np.median(values_b)),
        float(np.median(differences)),
        low,
        high,
        _verdict(low, high),
        note,
    )


def _interval(differences):
    from scipy.stats import quantile_test

    if len(differences) < FEWEST:
        return None, None
    interval = quantile_test(differences, p=0.5).confidence_interval(CONFIDENCE)
    return float(interval.low), float(interval.high)


def _verdict(low, high):
    if low is None or low <= 0 <= high:
        return Verdict.CANNOT_TELL
    return Verdict.BETTER if high < 0 else Verdict.WORSE
