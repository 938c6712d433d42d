"""Cases run in forked processes, each bounded in time and memory; none takes another with it."""

import contextlib
import io
import json
import os
import random
import re
import resource
import selectors
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from pathlib import Path

from idem_ros.core import workers

SECONDS, MEMORY = 10.0, 2 * 2**30  # of one case; [bytes]
WAIT = 60.0  # [s] of real time, for what waits and does nothing
BATCH = 40
MOST_OF_LINE = 2500
SHOWN = 5  # lines
WARNED = re.compile(r'\.py:\d+: \w*Warning: ')
TICKS = os.sysconf('SC_CLK_TCK')


def run_all(kinds, counts, seed, jobs):
    """Run cases; yield {'kind', 'index', 'code', 'seconds', 'fault'} of each, '' for no fault."""
    batches = [
        (kind, list(range(first, min(first + BATCH, counts[kind]))))
        for kind in kinds
        for first in range(0, counts[kind], BATCH)
    ]
    running, selector = {}, selectors.DefaultSelector()
    try:
        while batches or running:
            while batches and len(running) < jobs:
                child = _Child(kinds, *batches.pop(0), seed)
                running[child.pid] = child
                selector.register(child.pipe, selectors.EVENT_READ, child)
            for key, _ in selector.select(timeout=0.5):
                yield from key.data.read()
            for child in list(running.values()):
                child.kill_if_late()
                if child.ended:
                    selector.unregister(child.pipe)
                    del running[child.pid]
                    yield from child.last_words()
                    if child.left:
                        batches.insert(0, (child.kind, child.left))
    finally:
        for child in running.values():
            os.kill(child.pid, signal.SIGKILL)
            os.waitpid(child.pid, 0)


class _Child:
    """A forked process with some cases of a kind."""

    def __init__(self, kinds, kind, indices, seed):
        self.kind, self.left, self.ended = kind, indices, False
        self._worked, self._cpu, self._late, self._text = time.monotonic(), 0.0, '', b''
        self._cpu_before = 0.0  # when the case began [s]
        self.pipe, writing = os.pipe()
        self.pid = os.fork()
        if not self.pid:
            os.close(self.pipe)
            _run(kinds[kind], kind, indices, seed, writing)
        os.close(writing)

    def read(self):
        """Yield what came of cases that ended."""
        content = os.read(self.pipe, 2**16)
        self.ended = not content
        *lines, self._text = (self._text + content).split(b'\n')
        for line in lines:
            self.left = self.left[1:]
            self._cpu_before = self._cpu_now()
            yield json.loads(line)

    def kill_if_late(self):
        """End a case that takes too long."""
        if self.ended:
            return
        cpu = self._cpu_now()
        if cpu > self._cpu:
            self._cpu, self._worked = cpu, time.monotonic()
        spent, waited = cpu - self._cpu_before, time.monotonic() - self._worked
        if spent > SECONDS + 5 or waited > WAIT:
            self._late = f'killed after {spent:.0f} s of work, {waited:.0f} s without any'
            os.kill(self.pid, signal.SIGKILL)

    def last_words(self):
        """Yield the case that ended the process, if one did."""
        os.close(self.pipe)
        _, status = os.waitpid(self.pid, 0)
        code = os.waitstatus_to_exitcode(status)
        if self.left:
            fault = self._late or f'the process ended with {code}'
            index, self.left = self.left[0], self.left[1:]
            yield {'kind': self.kind, 'index': index, 'code': code, 'seconds': 0, 'fault': fault}

    def _cpu_now(self):
        try:
            stat = Path(f'/proc/{self.pid}/stat').read_text()
        except OSError:
            return self._cpu
        user, system = stat.rpartition(')')[2].split()[11:13]
        return (int(user) + int(system)) / TICKS


def _run(cases, kind, indices, seed, writing):
    """Run cases, write a line of JSON for each, and end the process."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    for category in (RuntimeWarning, UserWarning):  # of each case, not of the first alone
        warnings.simplefilter('always', category)
    workers._pool.cache_clear()  # a fork has no threads; those of the parent would never answer
    size = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**30, 2**30))
    try:
        for index in indices:
            found = run_one(cases, kind, index, seed)
            os.write(writing, json.dumps(found).encode() + b'\n')
    finally:
        os._exit(0)


def run_one(cases, kind, index, seed, keep=False):
    """Run a case in a folder of its own; return what `run_all` yields."""
    rng = random.Random(f'{seed} {kind} {index}')
    folder = tempfile.mkdtemp(prefix='idem_fuzz_')
    os.chdir(folder)
    try:
        arguments = cases.write(rng)
        if keep:
            print(f'cd {folder}; idem {" ".join(arguments)}')
        start = time.process_time()
        code, fault = _fault_of(arguments)
        seconds = time.process_time() - start
    except Exception:
        code, fault, seconds = None, traceback.format_exc(), 0.0
    finally:
        os.chdir('/')
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    if seconds > SECONDS and not fault:
        fault = f'{seconds:.1f} s'
    return {'kind': kind, 'index': index, 'code': code, 'seconds': seconds, 'fault': fault}


def _fault_of(arguments):
    """Return the exit code, and what is wrong: what libraries write themselves, too."""
    with tempfile.TemporaryFile() as past:
        with _past_python(past):
            code, fault = _fault_in_python(arguments)
        past.seek(0)
        said = past.read().decode(errors='replace').splitlines()
    # what is logged goes to the stderr of the beginning
    raw = [line for line in said if not (line.startswith('idem: ') and line.isprintable())]
    return code, fault or (f'{arguments}: a library says {raw[:SHOWN]}' if raw else '')


@contextlib.contextmanager
def _past_python(file):
    """Have a file take what is written to stdout and stderr but by Python."""
    kept = {descriptor: os.dup(descriptor) for descriptor in (1, 2)}
    try:
        for descriptor in kept:
            os.dup2(file.fileno(), descriptor)
        yield
    finally:
        for descriptor, before in kept.items():
            os.dup2(before, descriptor)
            os.close(before)


def _fault_in_python(arguments):
    from idem_ros.commands.main import main

    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(arguments)
    except SystemExit as ended:
        code = ended.code
    except BaseException:
        return None, f'{arguments}: {traceback.format_exc()}'
    said = err.getvalue()
    warned = [line for line in said.splitlines() if WARNED.search(line)]
    if warned:
        return code, f'{arguments}: {warned[:SHOWN]}'
    lines = [line for line in said.splitlines() if line.startswith('idem: error:')]
    if code not in (0, 1, 2):
        return code, f'{arguments}: exit code {code}'
    if 'Traceback' in said or len(lines) > 1 or any(len(line) > MOST_OF_LINE for line in lines):
        return code, f'{arguments}: {said[:MOST_OF_LINE]}'
    if not (out.getvalue() + said).replace('\n', '').replace('\t', '').isprintable():
        return code, f'{arguments}: what is printed holds control characters'
    return code, ''
