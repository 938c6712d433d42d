"""The peers' figures out of an earlier run: while IDEM is tuned, they stay what they are."""

import json
from dataclasses import replace
from pathlib import Path

from benchmarks.accuracy import Figures
from benchmarks.methods import IDEM, Setting
from idem_ros.core import IdemError


class NotMeasured(IdemError):
    """A file that does not hold the figures that are asked of it."""


def with_peers_of(results, path):
    """Return `RowResult`s of IDEM alone with the peers' figures from a JSON file added.

    Raises:
        NotMeasured: the file is no record of `python -m benchmarks accuracy`, or lacks a row.
    """
    try:
        rows = {row['name']: row for row in json.loads(Path(path).read_text())['rows']}
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise NotMeasured(
            f'{path} is no JSON of `python -m benchmarks accuracy` ({error}); make one with --json'
        ) from error
    return [_completed(result, rows, path) for result in results]


def _completed(result, rows, path):
    if result.name not in rows:
        raise NotMeasured(f'{path} lacks the row {result.name!r}; it has {", ".join(rows)}')
    runs, before = result.levels[0][0].runs, rows[result.name]['levels'][0][0]['runs']
    if runs != before:
        raise NotMeasured(
            f'{path} has {before} runs a level of {result.name!r}, here are {runs}; '
            'give --quick both times or never'
        )
    levels = zip(result.levels, rows[result.name]['levels'], strict=True)
    return replace(result, levels=tuple(ours + _peers(theirs) for ours, theirs in levels))


def _peers(records):
    figures = (Figures(**{**r, 'setting': Setting(*r['setting'])}) for r in records)
    return tuple(f for f in figures if f.method != IDEM)
