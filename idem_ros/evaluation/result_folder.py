"""The folder of results of many recordings: all made alike, none ever overwritten."""

import json
import re
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.evaluation.one_recording import identity
from idem_ros.files.atomic_file import UnwritableFile, replacing, require_folder_around
from idem_ros.files.structured_text import parse_json
from idem_ros.results.result_file import read_result

MADE_WITH, SUMMARY = 'evaluation.json', 'summary.json'
"""What all results of a folder are made with, and what they are together."""
SUM_SHOWN = 8  # digits of a recording's checksum in the name of its result


class OtherResults(IdemError):
    """A folder that holds something else than results of these settings."""


def open_folder(folder, made_with):
    """Make a folder for results, or go on with one; nothing in it is changed.

    Args:
        folder: it, or the folder around it, must exist.
        made_with: a record of all that decides what the results are.

    Returns:
        {`identity` of a recording: `Path` of its result} of the results that are there.

    Raises:
        OtherResults: the folder holds other files, or results made with something else.
        UnreadableResult: a result in it is none.
        UnwritableFile: it cannot be made or written.
    """
    folder = Path(folder)
    require_folder_around(folder)
    try:
        folder.mkdir(exist_ok=True)
        empty = not any(folder.iterdir())
    except OSError as error:
        raise UnwritableFile(f'cannot make the folder {folder}: {error.strerror}') from error
    if empty:
        write_json(folder / MADE_WITH, made_with)
        return {}
    _require_same(folder, made_with)
    return dict(_results_in(folder, made_with))


def result_file(folder, outcome_identity):
    """Return the path that the result of a recording has: its name, and of its checksum enough."""
    name, _, sum_ = outcome_identity.rsplit(' ', 2)
    return Path(folder) / f'{Path(name).stem}.{sum_[:SUM_SHOWN]}.json'


def write_text(path, text):
    """Write a file that appears complete or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding='utf-8', errors='backslashreplace')


def write_json(path, record):
    """Write a record that JSON can hold, as `write_text` does."""
    write_text(path, json.dumps(record, indent=1, allow_nan=False) + '\n')


def _require_same(folder, made_with):
    path = folder / MADE_WITH
    if not path.exists():
        raise OtherResults(
            f'{folder} holds other files than results of an evaluation (it has no {MADE_WITH}); '
            'name a new folder'
        )
    try:
        before = parse_json(path.read_bytes())
    except (OSError, ValueError) as error:
        raise OtherResults(f'{path} cannot be read: {error}; name a new folder') from error
    differing = sorted(_differing(before, json.loads(json.dumps(made_with))))
    if differing:
        raise OtherResults(
            f'{folder} holds results made with other {", ".join(differing)}; name a new folder'
        )


def _differing(a, b, name=''):
    """Yield the names of the entries in which two records differ."""
    if not (isinstance(a, dict) and isinstance(b, dict)):
        if a != b:
            yield name or 'content'
        return
    for key in {**a, **b}:
        yield from _differing(a.get(key), b.get(key), key)


def _results_in(folder, made_with):
    for path in sorted(folder.glob('*.json')):
        if path.name in (MADE_WITH, SUMMARY) or re.match(r'\.', path.name):
            continue
        made_by = read_result(path).made_by or {}
        known = {'name', 'size', 'sha256'} <= made_by.get('input', {}).keys()
        if not known or list(_differing_settings(made_by, made_with)):
            raise OtherResults(f'{path} was made with other settings; name a new folder')
        yield identity(made_by['input']), path


def _differing_settings(made_by, made_with):
    for key, value in made_with['settings'].items():
        yield from _differing(json.loads(json.dumps(value)), made_by.get(key), key)
