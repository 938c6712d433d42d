"""Many results in numbers: of each recording, and pooled over the frames of all."""

import numpy as np

from idem_ros.results.result_file import COUNTS
from idem_ros.results.summary import percentiles
from idem_ros.terminal.markdown import number, table
from idem_ros.terminal.printable import printable

PERCENTILES = {
    'time_ms': {'median': 50, 'p95': 95},
    'translation_error_m': {'median': 50, 'p90': 90},
    'translation_error_m_before': {'median': 50, 'p90': 90},
    'rotation_error_deg': {'median': 50, 'p90': 90},
    'rotation_error_deg_before': {'median': 50, 'p90': 90},
}
SHOWN = (
    ('translation [m] before', 'translation_error_m_before', 'median'),
    ('after', 'translation_error_m', 'median'),
    ('p90', 'translation_error_m', 'p90'),
    ('rotation [deg] before', 'rotation_error_deg_before', 'median'),
    ('after', 'rotation_error_deg', 'median'),
    ('p90', 'rotation_error_deg', 'p90'),
    ('time [ms]', 'time_ms', 'median'),
    ('p95', 'time_ms', 'p95'),
)


class Overall:
    """Takes in one recording after the other; keeps five numbers of each frame."""

    def __init__(self):
        self._recordings = {}
        self._numbers = []

    def add(self, bag, record, result=None):
        """Take in what became of a recording.

        Args:
            bag: its path.
            record: of its replay, see `summary.json_record`.
            result: the path of the file that holds the record; None: none does.
        """
        numbers = {name: _values(record['frames'], name) for name in PERCENTILES}
        self._numbers.append(numbers)
        self._recordings[bag] = {
            'bag': bag,
            'result': result and str(result),
            **_counted({name: record['summary'][name] for name in COUNTS}, numbers),
            'notes': record.get('notes', []),
        }

    def add_failure(self, bag, reason):
        """Take in why a recording could not be evaluated."""
        self._recordings[bag] = {'bag': bag, 'reason': reason}

    def record(self):
        """Return it all as what JSON holds.

        Returns:
            {'evaluated', 'failed': how many, 'recordings': [{'bag', 'result', 'frames', ...} or
            {'bag', 'reason'}], 'pooled': {'frames', ...}}, recordings in the order of their
            names; None where unknown.
        """
        recordings = [self._recordings[bag] for bag in sorted(self._recordings)]
        evaluated = [entry for entry in recordings if 'reason' not in entry]
        counts = {name: sum(entry[name] for entry in evaluated) for name in COUNTS}
        pooled = {
            name: np.concatenate([each[name] for each in self._numbers] or [[]])
            for name in PERCENTILES
        }
        return {
            'evaluated': len(evaluated),
            'failed': len(recordings) - len(evaluated),
            'recordings': recordings,
            'pooled': _counted(counts, pooled),
        }


def overall_table(record):
    """Return a record of `Overall` as text: a row for each recording, then what failed and why."""
    evaluated = [entry for entry in record['recordings'] if 'reason' not in entry]
    failed = [entry for entry in record['recordings'] if 'reason' in entry]
    rows = [_row(entry['bag'], entry) for entry in evaluated]
    header = ['median of', *COUNTS, 'with truth', *(title for title, _, _ in SHOWN)]
    lines = [table(header, [*rows, _row('all', record['pooled'])])] if rows else []
    for entry in evaluated:
        lines += [printable(f'note: {entry["bag"]}: {note}') for note in entry['notes']]
    lines.append(f'{len(evaluated)} of {len(evaluated) + len(failed)} recordings evaluated')
    lines += [
        printable(f'  not evaluated: {named(entry["bag"], entry["reason"])}') for entry in failed
    ]
    return '\n'.join(lines)


def named(bag, reason):
    """Return the reason why a recording failed, with its name in front where it lacks that."""
    return reason if reason.startswith(bag) else f'{bag}: {reason}'


def _values(frames, name):
    values = (frame.get(name) for frame in frames)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _counted(counts, numbers):
    return {
        **counts,
        'with_truth': int(np.isfinite(numbers['translation_error_m']).sum()),
        **{name: percentiles(values, **PERCENTILES[name]) for name, values in numbers.items()},
    }


def _row(name, entry):
    counts = (entry[n] for n in (*COUNTS, 'with_truth'))
    return [name, *counts, *(number(entry[n][p]) for _, n, p in SHOWN)]
