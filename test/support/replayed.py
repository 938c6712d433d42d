"""A small recording and the result of replaying it, as `idem replay --json` writes it."""

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from recordings import scans

from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay
from idem_ros.results.result_file import record_text
from idem_ros.results.summary import json_record


def replayed(folder, messages, **options):
    """Write messages as scans.mcap into a folder, and replay that."""
    write_mcap(folder / 'scans.mcap', messages)
    return replay(folder / 'scans.mcap', **options)


def write_replayed(folder, n=4, name='result', truth=True):
    """Write scans.mcap and a result of its n frames into a folder; return the result's path."""
    recording, text = _once(n, truth)
    (folder / 'scans.mcap').write_bytes(recording)
    record = json.loads(text)
    record['bag'] = str(folder / 'scans.mcap')
    path = folder / f'{name}.json'
    path.write_text(''.join(record_text(record)))
    return path


@cache
def _once(n, truth):
    """Return the bytes of a recording and of its result, which many tests begin with."""
    rng = np.random.default_rng(0)
    messages = [each for each in scans(rng, n) if truth or each[0] != '/ground_truth']
    with TemporaryDirectory() as folder:
        found = replayed(Path(folder), messages)
        text = ''.join(record_text(json_record(found)))
        return (Path(folder) / 'scans.mcap').read_bytes(), text


def write_record(path, record):
    path.write_text(json.dumps(record, allow_nan=False))
    return path


def changed(path, change, name='changed'):
    """Write a copy of a result beside it that `change` has been applied to; return its path."""
    record = json.loads(path.read_text())
    count = len(record['frames'])
    change(record)
    frames = record.get('frames')
    if isinstance(frames, list) and len(frames) != count:
        record['summary']['frames'] = len(frames)
    return write_record(path.with_name(f'{name}.json'), record)
