"""The errors of a trajectory in numbers: a record for JSON, and a table to read."""

import numpy as np

from idem_ros.files.trajectory_file import Trajectory
from idem_ros.terminal.markdown import number, table
from idem_ros.trajectory.errors import (
    STATISTICS,
    TOLERANCE,
    alignment,
    ape,
    associate,
    path_length,
    rpe,
    statistics,
)
from idem_ros.trajectory.kitti_segments import LENGTHS, segment_errors

DELTAS = ((1, 'f'), (1.0, 'm'))
MEASURES = {
    'translation_m': 'translation [m]',
    'rotation_deg': 'rotation [deg]',
    'full': 'full [-]',
}


def compared(
    reference,
    estimate,
    *,
    align=False,
    deltas=DELTAS,
    all_pairs=False,
    lengths=LENGTHS,
    tolerance=TOLERANCE,
):
    """Return all errors of an estimated trajectory as a record that JSON can hold.

    Args:
        reference, estimate: `Trajectory`, as they were read.
        align: whether the estimate is first moved onto the reference, see `alignment`.
        deltas: (number, unit) of each RPE, see `rpe`.
        all_pairs: see `rpe`.
        lengths: of KITTI's segments [m].
        tolerance: between stamps that belong together [s].

    Returns:
        {'poses', 'path_length_m', 'alignment', 'ape', 'rpe', 'kitti'}; None where there is
        nothing to measure.

    Raises:
        IncomparableTrajectories: see `associate` and `alignment`.
    """
    poses = {'reference': len(reference), 'estimate': len(estimate)}
    reference, estimate = associate(reference, estimate, tolerance)
    T_reference_estimate = alignment(reference, estimate) if align else None
    if align:
        estimate = Trajectory(T_reference_estimate @ estimate.poses, estimate.stamps)
    return {
        'poses': {**poses, 'matched': len(reference)},
        'path_length_m': float(path_length(reference)[-1]),
        'alignment': None if T_reference_estimate is None else T_reference_estimate.tolist(),
        'ape': _statistics_of(ape(reference, estimate)),
        'rpe': [_rpe(reference, estimate, *delta, all_pairs) for delta in deltas],
        'kitti': _kitti(segment_errors(reference, estimate, lengths), lengths),
    }


def report(record):
    """Return a record of `compared` as lines of text: what was matched, then two tables."""
    poses, kitti = record['poses'], record['kitti']
    lines = [
        f'{poses["matched"]} poses matched, of {poses["reference"]} in the reference and '
        f'{poses["estimate"]} in the estimate; {record["path_length_m"]:.2f} m; '
        f'{"aligned" if record["alignment"] else "as given, not aligned"}',
        '',
        table(['error', *STATISTICS, 'n'], _rows(record)),
    ]
    segments = [_segment_row(f'{row["length_m"]:g} m', row) for row in kitti['by_length']]
    header = ["KITTI's segments", 'translation [%]', 'rotation [deg/100 m]', 'n']
    if kitti['segments']:
        lines.append(table(header, [*segments, _segment_row('all', kitti)]).rstrip())
    else:
        shortest = min(row['length_m'] for row in kitti['by_length'])
        lines.append(f"KITTI's segments: none, the path is shorter than {shortest:g} m")
    return '\n'.join(lines)


def _rpe(reference, estimate, delta, unit, all_pairs):
    errors = rpe(reference, estimate, delta, unit, all_pairs)
    return {'delta': delta, 'unit': unit, 'all_pairs': all_pairs, **_statistics_of(errors)}


def _statistics_of(errors):
    return {
        'pairs': len(errors),
        **{key: statistics(getattr(errors, key)) for key in MEASURES},
    }


def _kitti(segments, lengths):
    return {
        **_mean_of(segments, np.full(len(segments), True)),
        'by_length': [
            {'length_m': length, **_mean_of(segments, segments.length_m == length)}
            for length in lengths
        ],
    }


def _mean_of(segments, which):
    def mean(values):
        return float(values[which].mean()) if which.any() else None

    return {
        'segments': int(which.sum()),
        'translation_percent': mean(segments.translation_percent),
        'rotation_deg_per_100m': mean(segments.rotation_deg_per_100m),
    }


def _rows(record):
    measured = [('APE', record['ape'])]
    measured += [(f'RPE {errors["delta"]:g} {errors["unit"]}', errors) for errors in record['rpe']]
    return [
        [f'{name} {title}', *map(_digits, errors[key].values()), errors['pairs']]
        for name, errors in measured
        for key, title in MEASURES.items()
    ]


def _segment_row(name, row):
    keys = 'translation_percent', 'rotation_deg_per_100m'
    return [name, *(number(row[key]) for key in keys), row['segments']]


def _digits(value):
    return '-' if value is None else f'{value:.6g}'
