"""What evaluating recordings costs beside the refinements: memory, reading, worker processes."""

import json
import resource
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from benchmarks import CHECKOUT
from benchmarks.case import displaced
from benchmarks.footprint import resident_and_peak
from benchmarks.goal import Goal
from benchmarks.main_job import DEMO, DEMO_VOXEL, DemoMissing
from idem_ros.core.geometry import se3
from idem_ros.evaluation.one_recording import Task
from idem_ros.evaluation.worker_processes import in_processes
from idem_ros.files.installed_file import installed_file
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.messages import cloud_message, header, transform_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import find_topics
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.pairs import pairs_of
from idem_ros.replay.run import replay
from idem_ros.replay.settings import Settings
from idem_ros.simulation.body import SIZE, surface_points

SCANS, FIRST = 10_000, 1_000
TARGET_POINTS, SCAN_POINTS = 1000, 600
OFF_DEG, OFF = 3.0, 0.05 * SIZE
START, STEP = 10**9, 10**8  # [ns]
KEPT, SHARE, SPEED_UP = 200, 15.0, 1.7  # [bytes], [%], times
ROUNDS, RECORDINGS, REPEATS = 5, 4, 12


def measure(config, quick=False, progress=lambda steps: steps):
    """Return the `Goal`s of evaluations.

    Args:
        config: `RegistrationConfig`; its voxel_size is the demo's where the demo is replayed.
        quick: fewer scans, rounds and repetitions.
        progress: wraps the iteration over the steps.
    """
    config = replace(config, voxel_size=DEMO_VOXEL)
    with tempfile.TemporaryDirectory(prefix='idem_bench_') as folder:
        folder = Path(folder)
        steps = (
            lambda: memory(folder, *((FIRST // 2, SCANS // 4) if quick else (FIRST, SCANS))),
            lambda: reading(_demo(), config, 1 if quick else ROUNDS),
            lambda: jobs(_demo(), folder, config, *((1, 1) if quick else (REPEATS, ROUNDS // 2))),
        )
        return [goal for step in progress(steps) for goal in step()]


def small_scans(count, seed=0, points=SCAN_POINTS):
    """Yield (topic, log time, message) of many small scans of one surface, as they are needed."""
    rng = np.random.default_rng(seed)
    yield '/target', START, cloud_message(surface_points(rng, TARGET_POINTS), START, 'map')
    for i in range(1, count + 1):
        stamp = START + i * STEP
        seen = surface_points(rng, points)
        truth = displaced(np.eye(4), np.zeros(3), 20.0, SIZE, rng)
        source = se3.transform_points(se3.inverse(truth), seen)
        guess = displaced(truth, source.mean(axis=0), OFF_DEG, OFF, rng)
        yield '/source', stamp, cloud_message(source, stamp, 'lidar')
        for k, (topic, pose) in enumerate((('/initial_guess', guess), ('/ground_truth', truth))):
            yield topic, stamp + k + 1, transform_message(pose, stamp, 'map', 'lidar')


def memory(folder, first, scans, points=SCAN_POINTS):
    """Yield what a scan costs: the peak of `idem replay` over many, less that over a few.

    Each in a process of its own, with all outputs. What stays of a scan are its truth (112
    bytes), its stamp, and where it lies on disk; at the end also seven numbers of the summary.
    """
    few, _ = peak_and_frames(folder, first, points)
    many, frames = peak_and_frames(folder, scans, points)
    yield Goal(f'of {scans} scans not refined', scans - frames, 0)
    mib = f'{few / 2**20:.1f} MiB over {first} scans, {many / 2**20:.1f} over {scans}'
    yield Goal(f'memory: {mib}; of a scan', (many - few) / (scans - first), KEPT, 'bytes')


def peak_and_frames(folder, scans, points):
    """Return the peak memory [bytes] of replaying so many scans, and the frames that came out."""
    outputs = (f'--{name}={folder}/small.{name}' for name in ('json', 'tum'))
    arguments = ['replay', f'{folder}/scans.mcap', *outputs, f'--out={folder}/small.mcap']
    write_mcap(folder / 'scans.mcap', small_scans(scans, points=points))
    command = [sys.executable, '-m', 'benchmarks.evaluation', *arguments]
    ended = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=True)
    frames = json.loads((folder / 'small.json').read_bytes())['summary']['frames']
    return int(ended.stdout.splitlines()[-1]), frames


def reading(path, config, rounds):
    """Yield the share of reading and pairing in the time of the refinements, median of rounds."""
    shares = []
    replay(path, config)  # warm
    for _ in range(rounds):
        start = perf_counter()
        with open_recording(path) as recording:
            pairs = sum(1 for _ in pairs_of(recording, find_topics(recording)))
        seconds = perf_counter() - start
        frames = replay(path, config).frames
        shares.append(100 * seconds / sum(frame.refinement.time_ms / 1e3 for frame in frames))
    what = f'demo, {pairs} scans: reading and pairing, of the refinements'
    yield Goal(what, float(np.median(shares)), SHARE, '%')


def jobs(path, folder, config, repeats, rounds):
    """Yield the time of two worker processes over that of one, on several recordings.

    Each worker registers in one thread, as it does unless told otherwise. The fastest round of
    each counts: others are those of a machine that did something else besides.
    """
    tasks = []
    for i in range(RECORDINGS):
        copy = folder / f'drive_{i}.mcap'
        write_mcap(copy, repeated(path, repeats))
        tasks.append(Task(str(copy), Settings(config), {}))
    runs = [(_evaluated(tasks, 1), _evaluated(tasks, 2)) for _ in range(rounds)]
    for count, each in enumerate(zip(*runs, strict=True), start=1):
        failed = max(run.failed for run in each)
        yield Goal(f'--jobs {count}: of {len(tasks)} recordings not evaluated', failed, 0)
    one, two = map(min, zip(*runs, strict=True))
    what = ', '.join(
        f'--jobs {count} ({run.seconds:.1f} s; {run.cpu:.1f} s of CPU)'
        for count, run in ((2, two), (1, one))
    )
    yield Goal(f'{what}: the time of 2 over that of 1', two.seconds / one.seconds, 1 / SPEED_UP)


class _Run(NamedTuple):
    """What evaluating all recordings took; the fastest is the least."""

    seconds: float
    cpu: float
    """Of all workers [s]."""
    failed: int


def _evaluated(tasks, count):
    cpu, start = _cpu_of_children(), perf_counter()
    failed = sum(bool(outcome.reason) for _, outcome in in_processes(tasks, count))
    return _Run(perf_counter() - start, _cpu_of_children() - cpu, failed)


def _cpu_of_children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def repeated(path, repeats):
    """Yield the messages of a recording several times over, each time later; the target once."""
    with open_recording(path) as recording:
        topics = find_topics(recording)
        span = 0
        for k in range(repeats):
            last = 0
            for topic, log_time, message in recording.messages(recording.topics):
                last = max(last, log_time)
                if k and topic == topics.target:
                    continue
                stamp = stamp_ns(message) + k * span
                later = replace(message, header=header(stamp, message.header.frame_id))
                yield topic, log_time + k * span, later
            span = span or last - START + STEP


def _demo():
    path = installed_file(DEMO)
    if path is None:
        raise DemoMissing(f'{DEMO} is not here; it lies in the checkout')
    return path


if __name__ == '__main__':
    from idem_ros.commands.main import main

    main(sys.argv[1:])
    print(resident_and_peak()[1])
