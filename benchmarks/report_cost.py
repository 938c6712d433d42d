"""What a report costs: time and size for a result of a thousand frames."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from benchmarks.goal import Goal
from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay
from idem_ros.report.folder import write_report
from idem_ros.results.result_file import record_text
from idem_ros.results.summary import json_record

FRAMES = 1000
CONFIG = RegistrationConfig(voxel_size=0.5)
SECONDS, MEGABYTES = 30.0, 10.0
NOISE = ('translation_error_m', 'rotation_error_deg', 'q_tot', 'q_mean', 'time_ms')


def measure(bag, frames=FRAMES):
    """Return the `Goal`s of a report on a generated result.

    Its frames are those of a recording, over and over with numbers that vary; the worst of them
    are in the recording, so that all their pictures are drawn.

    Args:
        bag: a recording of at least ten pairs.
        frames: of the result.
    """
    with TemporaryDirectory() as folder:
        result, report = Path(folder) / 'result.json', Path(folder) / 'report'
        record = json.loads(''.join(record_text(json_record(replay(bag, CONFIG)))))
        result.write_text(json.dumps(repeated(record, frames)))
        start = perf_counter()
        page = write_report([result], report)
        seconds = perf_counter() - start
        drawn = len(list(report.glob('worst_*_q_tot.png')))
        megabytes = page.stat().st_size / 1e6
    what = f'report of {frames} frames, {drawn} of them drawn'
    return [Goal(what, seconds, SECONDS, 's'), Goal(what, megabytes, MEGABYTES, 'MB')]


def repeated(record, count):
    """Return a result's record with `count` frames: its own, then such as resemble them."""
    rng = np.random.default_rng(0)
    own = record['frames']
    period = own[-1]['stamp_ns'] - own[0]['stamp_ns'] + 10**8
    frames = []
    for i in range(count):
        lap, k = divmod(i, len(own))
        frame = dict(own[k], stamp_ns=own[k]['stamp_ns'] + lap * period)
        factor = rng.uniform(0.2, 0.9) if lap else 5.0  # the worst have pictures
        frame.update({name: frame[name] * factor for name in NOISE if frame[name] is not None})
        frames.append(frame)
    return {**record, 'frames': frames, 'summary': {**record['summary'], 'frames': count}}
