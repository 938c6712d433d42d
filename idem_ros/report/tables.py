"""The tables of a report: rows of plain values, for the page and for CSV files alike."""

import csv
import io
import json
import re
from collections import Counter
from dataclasses import dataclass
from itertools import product

import numpy as np

from idem_ros.refinement.diagnostics import known
from idem_ros.report.runs import MEASURES, SIGMAS, Run
from idem_ros.results.result_file import COUNTS
from idem_ros.terminal.printable import cell

WHEN = ('before', 'after')
STATISTICS = {'median': 50, 'p90': 90, 'max': 100}
WORST = (
    'translation_error_m',
    'rotation_error_deg',
    'sigma_m',
    'sigma_deg',
    'basin',
    'q_mean',
    'q_tot',
    'overlap',
    'time_ms',
)
TITLES = {
    'sigma_m': 'sigma of the position [m]',
    'sigma_deg': 'sigma of the rotation [deg]',
    'basin': 'basin [share]',
    **{measure.name: measure.label for measure in MEASURES},
}
NUMBER = re.compile(r'\d[\d.e+-]*')
JUDGED = ('p_aligned', *SIGMAS, 'basin')


@dataclass(frozen=True)
class Table:
    """Cells are text, numbers, or None where a number is unknown."""

    header: tuple[str, ...]
    rows: list[tuple]


def outcomes(runs):
    """Return what became of the sources of each run, and how long it took."""
    times = [f'time {name} [ms]' for name in ('median', 'p95', 'max')]
    header = ('result', 'recording', *COUNTS, 'status', *times)
    rows = []
    for run in runs:
        counts = [run.result.counts[name] for name in COUNTS]
        time_ms = _percentiles(run.values('time_ms'), (50, 95, 100))
        rows.append((run.name, run.result.bag, *counts, _statuses(run.result), *time_ms))
    return Table(header, rows)


def verdicts(runs):
    """Return how the frames of each run were judged: of each verdict the commonest reason."""
    header = ('result', 'verdict', 'frames', 'share', 'commonest reason')
    header += tuple(f'{name} median' for name in ('p_aligned', *map(TITLES.get, JUDGED[1:])))
    rows = []
    for run in runs:
        found = [frame.get('verdict') for frame in run.result.frames]
        for verdict, count in Counter(filter(None, found)).most_common():
            which = np.array([each == verdict for each in found])
            reason = _commonest(
                run.result.frames[i].get('verdict_reason') for i in which.nonzero()[0]
            )
            medians = (_percentiles(run.values(name)[which], (50,))[0] for name in JUDGED)
            rows.append((run.name, verdict, count, count / len(found), reason, *medians))
    return Table(header, rows)


def _commonest(reasons):
    """Return the commonest of reasons, whatever numbers are in them."""
    reasons = [reason or '' for reason in reasons]
    alike = [NUMBER.sub('', reason) for reason in reasons]
    return reasons[alike.index(Counter(alike).most_common(1)[0][0])]


def before_and_after(runs: list[Run]):
    """Return median, 90th percentile and maximum of each measure, at the guess and refined."""
    header = ('number', 'result', *(f'{n} {when}' for n, when in product(STATISTICS, WHEN)))
    rows = []
    for measure, run in product(MEASURES, runs):
        before, after = (
            _percentiles(run.values(name), STATISTICS.values())
            for name in (measure.before, measure.name)
        )
        if after[0] is not None or before[0] is not None:
            pairs = [number for pair in zip(before, after, strict=True) for number in pair]
            rows.append((measure.label, run.name, *pairs))
    return Table(header, rows)


def parameters(runs):
    """Return how each run was made, where its result says so: a column a run."""
    records = [run.result.settings() for run in runs]
    names = dict.fromkeys(name for record in records for name in record)
    rows = [(name, *(record.get(name) for record in records)) for name in names]
    return Table(('setting', *(run.name for run in runs)), rows)


def every_number(runs):
    """Return the statistics of every number that a frame of any run holds."""
    names = dict.fromkeys(name for run in runs for name in run.columns)
    rows = [
        (name, run.name, *_percentiles(run.values(name), STATISTICS.values()))
        for name, run in product(names, runs)
    ]
    return Table(('number', 'result', *STATISTICS), rows)


def frames(run):
    """Return every frame of a run with all it holds; transforms as the numbers of three rows."""
    derived = [name for name in run.columns if name.startswith(('second_difference', 'sigma_'))]
    records = [_flat(frame) for frame in run.result.frames]
    for i, record in enumerate(records):
        record['seconds'] = float(run.seconds[i])
        record.update({name: known(run.columns[name][i]) for name in derived})
    header = tuple(dict.fromkeys(name for record in records for name in record))
    rows = [(i, *map(record.get, header)) for i, record in enumerate(records)]
    return Table(('frame', *header), rows)


def worst(run, order):
    """Return the frames of some indices with the numbers that say why they are there."""
    names = [name for name in WORST if np.isfinite(run.values(name)).any()]
    texts = {'verdict': 'verdict', 'verdict_reason': 'reason'}
    said = [name for name in texts if any(frame.get(name) for frame in run.result.frames)]
    rows = [
        (
            int(i),
            float(run.seconds[i]),
            run.result.frames[i].get('status'),
            *(run.result.frames[i].get(name) or None for name in said),
            *(known(run.values(name)[i]) for name in names),
        )
        for i in order
    ]
    titles = *(texts[name] for name in said), *(TITLES[name] for name in names)
    return Table(('frame', 'time [s]', 'status', *titles), rows)


def csv_text(table):
    """Return a table as CSV; an unknown number is an empty cell, and no text a formula."""
    text = io.StringIO()
    rows = [[cell(each) for each in row] for row in [table.header, *table.rows]]
    csv.writer(text, lineterminator='\n').writerows(rows)
    return text.getvalue()


def _statuses(result):
    found = Counter(str(frame.get('status', 'unknown')) for frame in result.frames)
    return ', '.join(f'{count} {status}' for status, count in found.most_common())


def _percentiles(values, percents):
    known = values[np.isfinite(values)]
    return [float(np.percentile(known, percent)) if known.size else None for percent in percents]


def _flat(frame):
    record = {}
    for name, value in frame.items():
        if _is_matrix(value):
            record.update({f'{name}_{i}{j}': value[i][j] for i, j in product(range(3), range(4))})
        else:
            record[name] = json.dumps(value) if isinstance(value, list | dict) else value
    return record


def _is_matrix(value):
    rows = value if isinstance(value, list) and len(value) == 4 else [None]
    return all(isinstance(row, list) and len(row) == 4 for row in rows)
