"""Peak memory per point, and the time from process start to a first result: fresh processes."""

import json
import os
import resource
import subprocess
import sys
import tempfile
import tracemalloc
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks import CHECKOUT
from idem_ros.core import Cloud, RegistrationConfig, q_tot, register, warm_up

KIB = 1024  # ru_maxrss is in KiB on Linux
FIRST_RESULT = """
import sys, numpy
from idem_ros.core import register, RegistrationConfig
target, source, guess = (numpy.load(f'{sys.argv[1]}/{name}.npy') for name in ('a', 'b', 'T'))
print(register(target, source, guess, RegistrationConfig(voxel_size=float(sys.argv[2]))).status)
"""


def memory(case, a=1.0):
    """Return what one registration and one q_tot take in bytes per raw point, of both clouds.

    Points as given (no voxels), each call in a process of its own, over what the process held
    with the points loaded and the kernels ready.

    Returns:
        what -> {'resident', 'python'}: growth of the peak resident set; the peak that Python and
        numpy allocated (what kernels allocate themselves is not in it).
    """
    with _saved(case, case.truth) as folder:
        return {what: _fresh('memory', what, folder, str(a)) for what in _MEASURED}


def first_result(case, T_guess, cold):
    """Return (seconds, what it said meanwhile) from process start to a result printed.

    cold: with an empty numba cache, so that every kernel compiles.
    """
    with _saved(case, T_guess) as folder:
        environment = dict(os.environ)
        if cold:
            environment['NUMBA_CACHE_DIR'] = str(Path(folder) / 'numba')
        start = perf_counter()
        ended = subprocess.run(
            [sys.executable, '-c', FIRST_RESULT, folder, str(case.voxel_size)],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return perf_counter() - start, ended.stderr.strip()


class _saved(tempfile.TemporaryDirectory):  # noqa: N801 - reads as a function
    """A folder that holds the points and a transform for another process, while entered."""

    def __init__(self, case, T):
        super().__init__(prefix='idem_bench_')
        for name, array in (('a', case.target), ('b', case.source), ('T', T)):
            np.save(Path(self.name) / name, array)


def _fresh(*arguments):
    command = [sys.executable, '-m', 'benchmarks.footprint', *arguments]
    ended = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=True)
    return json.loads(ended.stdout)


def _measure(what, folder, a):
    """Run one measurement, in this process."""
    target, source, T = (np.load(Path(folder) / f'{name}.npy') for name in ('a', 'b', 'T'))
    warm_up()
    points = len(target) + len(source)
    before, _ = resident_and_peak()
    _MEASURED[what](target, source, T, float(a))
    resident = resident_and_peak()[1] - before
    tracemalloc.start()
    _MEASURED[what](target, source, T, float(a))
    python = tracemalloc.get_traced_memory()[1]
    return {'resident': resident / points, 'python': python / points}


def resident_and_peak():
    """What is resident now, and the most that ever was [bytes]; without /proc twice the latter.

    getrusage alone would not do: Linux hands a parent's peak on to the processes it starts.
    """
    try:
        lines = Path('/proc/self/status').read_text().splitlines()
    except OSError:
        peak = KIB * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak, peak
    kib = {line.split(':')[0]: line.split()[1] for line in lines if line.startswith('Vm')}
    return KIB * int(kib['VmRSS']), KIB * int(kib['VmHWM'])


_MEASURED = {
    'register': lambda target, source, T, a: register(
        target, source, T, RegistrationConfig(voxel_size=None, a=a)
    ),
    'q_tot': lambda target, source, T, a: q_tot(Cloud(target), Cloud(source), T, a=a),
}


if __name__ == '__main__':
    print(json.dumps(_measure(*sys.argv[2:])))
