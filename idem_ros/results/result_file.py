"""What `idem replay --json` or `--out` writes: its text, and numbers and counts read back."""

import json
from dataclasses import dataclass, field
from json import JSONEncoder
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.files.structured_text import parse_json
from idem_ros.recording.part import LOSSES

STAMPS = ('stamp', 'stamp_ns')
COUNTS = ('frames', 'refused', 'dropped', 'unpaired')
PARTS = ('interrupted', *LOSSES)
"""Counts of what is not in a result; those of an earlier version lack them."""

OTHER_KINDS = {
    'evaluated': 'it sums up an idem evaluate, whose results lie beside it, one a recording',
    'topics': 'it holds the settings of an idem evaluate, whose results lie beside it',
    'keyframes': 'it is the record of an idem smooth; idem trajectory compares such',
    'sensors': 'it is the record of an idem calibrate',
    'edges': 'it is what idem align prints',
    'T_target_source': 'it is what idem register prints, of two clouds',
    'differences': 'it is what idem compare prints',
}
"""What else our commands write as JSON, by a key that only it has."""

_encode = JSONEncoder(indent=1, allow_nan=False).encode


class UnreadableResult(IdemError):
    """A file that holds no result of a replay."""


@dataclass(frozen=True)
class Result:
    """A replay's result."""

    path: str
    bag: str
    """The recording that was replayed, as it was named then."""
    frames: tuple[dict, ...]
    """The record of each frame, see `summary.json_record`."""
    counts: dict[str, int]
    """How many sources were refined (frames), refused, dropped, unpaired; and `PARTS`."""
    record: dict = field(default_factory=dict)
    """All that was written: {'bag', 'frames', 'summary', 'made_by'}, see `summary.json_record`."""

    @property
    def made_by(self) -> Any:
        """How it was made, see `provenance.made_by`; None: by a version that did not say."""
        return self.record.get('made_by')

    def settings(self):
        """Return {setting: text} of `made_by`; of what is in a group, GROUP.NAME."""
        groups = dict(self.made_by or {})
        record = dict(groups.pop('parameters', None) or {})
        for group, value in groups.items():
            if isinstance(value, dict):
                record.update({f'{group}.{name}': each for name, each in value.items()})
            else:
                record[group] = value
        return {name: _said(value) for name, value in record.items()}

    def numbers(self):
        """Return the names of what frames hold one number of, in the record's order."""
        names = dict.fromkeys(
            name for frame in self.frames for name, value in frame.items() if _is_number(value)
        )
        return [name for name in names if name not in STAMPS]

    def values(self, name):
        """Return a number of each frame, (N,) float64; NaN where it is unknown."""
        values = [frame.get(name) for frame in self.frames]
        return np.array([np.nan if v is None else v for v in values], dtype=np.float64)


def read_result(path):
    """Read a result of `idem replay`: the JSON of `--json` or the MCAP of `--out`.

    Returns:
        `Result`, the same of both.

    Raises:
        UnreadableResult: no such file, or other content.
    """
    record = _parsed(path, _text(path))
    reason = _what_is_wrong(record)
    if reason:
        raise _no_result(path, reason)
    counts = {name: int(record['summary'].get(name, 0)) for name in (*COUNTS, *PARTS)}
    bag = record.get('bag') or 'an unnamed recording'
    return Result(str(path), bag, tuple(record['frames']), counts, record)


def _said(value):
    if value is None:
        return 'none'
    if isinstance(value, list):
        return ', '.join(map(_said, value))
    return value if isinstance(value, str) else json.dumps(value)


def _text(path):
    """Return the bytes of the JSON: a whole file, or what an MCAP carries."""
    from idem_ros.files.unreadable import refuse_special
    from idem_ros.recording.embedded import MAGIC, RECORD, UnreadableMcap, read_embedded

    refuse_special(path, UnreadableResult)
    if Path(path).is_dir():
        raise _no_result(path, 'it is a folder; name a file in it')
    try:
        with Path(path).open('rb') as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                stream.seek(0)
                return stream.read()
        attachments = read_embedded(path).attachments
    except OSError as error:
        raise UnreadableResult(f'{path} cannot be read: {error.strerror or error}') from error
    except UnreadableMcap as error:
        raise UnreadableResult(str(error)) from error
    if RECORD not in attachments:
        raise _no_result(path, f'it is a recording without an attachment {RECORD}')
    return attachments[RECORD]


def _parsed(path, text):
    if not text.strip():
        raise _no_result(path, 'it is no JSON: it is empty')
    try:
        return parse_json(text)
    except ValueError as error:  # of JSON, of UTF-8, of a number
        raise _no_result(path, f'it is no JSON: {error}') from error


def _what_is_wrong(record):
    from idem_ros.results.result_schema import what_is_wrong

    if not (isinstance(record, dict) and {'frames', 'summary'} <= record.keys()):
        return _other_kind(record) or 'it lacks "frames" or "summary"'
    if reason := what_is_wrong(record):
        return reason
    said, there = record['summary']['frames'], len(record['frames'])
    if said != there:
        return f'its summary tells of {said} frames, and it holds {there}'
    kinds = {}
    for frame in record['frames']:
        for name, value in frame.items():
            kind = _is_number(value)
            if value is not None and kinds.setdefault(name, kind) != kind:
                return f'its frames have {name[:60]!r} as a number and as something else'
    return ''


def _other_kind(record):
    """Return what else a record is that one of our commands wrote; empty: none of these."""
    names = record.keys() if isinstance(record, dict) else ()
    return next((said for key, said in OTHER_KINDS.items() if key in names), '')


def _no_result(path, reason):
    return UnreadableResult(
        f'{path} is no result of a replay ({reason}); '
        'idem replay BAG --json FILE (or --out FILE.mcap) writes one'
    )


def _is_number(value):
    return value is None or (isinstance(value, Real) and not isinstance(value, bool))


def record_text(record):
    """Yield the text of a record piece by piece, as `json.dumps(record, indent=1)` makes it.

    Args:
        record: see `summary.json_record`; its 'frames' are any iterable.

    Raises:
        ValueError: a number is not finite.
    """
    opening = '{'
    for name, value in record.items():
        yield f'{opening}\n {_encode(name)}: '
        yield from _list(value) if name == 'frames' else [_indented(value, 1)]
        opening = ','
    yield '\n}\n'


def _list(values):
    opening = '['
    for value in values:
        yield f'{opening}\n  {_indented(value, 2)}'
        opening = ','
    yield '[]' if opening == '[' else '\n ]'


def _indented(value, depth):
    return _encode(value).replace('\n', '\n' + depth * ' ')  # no string of JSON has a line break
