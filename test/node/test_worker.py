import subprocess
import sys
import threading
import time
from concurrent.futures import CancelledError

import pytest

from idem_ros.node.worker import LatestOnlyWorker

LONG = 30.0  # seconds until a test that hangs fails; no passing test waits for it


class Recorder:
    """A worker whose work blocks until it is let go, and what came out of it."""

    def __init__(self, work=None):
        self.results = []
        self.started, self.proceed, self.done = (threading.Semaphore(0) for _ in range(3))
        self._inner = work or (lambda item: item)
        self.worker = LatestOnlyWorker(self.work)

    def work(self, item):
        self.started.release()
        assert self.proceed.acquire(timeout=LONG)
        try:
            self.results.append((item, self._inner(item)))
        finally:
            self.done.release()

    def run_next(self):
        self.proceed.release()
        assert self.done.acquire(timeout=LONG)


@pytest.fixture
def recorder():
    recorders = []

    def make(work=None):
        recorders.append(Recorder(work))
        return recorders[-1]

    yield make
    for made in recorders:
        for _ in range(10):
            made.proceed.release()
        made.worker.stop()


def test_work_is_done_on_what_is_submitted(recorder):
    r = recorder(lambda item: item * 2)
    r.worker.submit(21)
    r.run_next()
    assert r.results == [(21, 42)]
    assert r.worker.dropped == 0


def test_newest_input_wins_and_those_between_are_dropped_and_counted(recorder):
    r = recorder()
    r.worker.submit('first')
    assert r.started.acquire(timeout=LONG)
    for item in ('second', 'third', 'newest'):
        r.worker.submit(item)
    r.run_next()
    r.run_next()
    assert [item for item, _ in r.results] == ['first', 'newest']
    assert r.worker.dropped == 2


def test_submit_does_not_wait_for_the_work_under_way(recorder):
    r = recorder()
    r.worker.submit('slow')
    assert r.started.acquire(timeout=LONG)
    r.worker.submit('next')  # would never come back if it did
    assert r.results == []


def test_worker_is_busy_while_the_work_is_under_way_only(recorder):
    r = recorder()
    assert not r.worker.is_busy
    r.worker.submit('slow')
    assert r.started.acquire(timeout=LONG)
    assert r.worker.is_busy
    r.run_next()
    r.worker.stop()
    assert not r.worker.is_busy


def test_error_in_the_work_is_logged_and_the_next_input_is_taken(recorder, caplog):
    r = recorder(lambda item: 1 / item)
    for item in (0, 1):
        r.worker.submit(item)
        r.run_next()
    assert r.results == [(1, 1.0)]
    (record,) = caplog.records
    assert 'division by zero' in str(record.exc_info[1])


def test_stop_ends_the_work_under_way_drops_what_waits_and_joins(recorder):
    r = recorder()
    r.worker.submit('under way')
    assert r.started.acquire(timeout=LONG)
    r.worker.submit('waiting')
    stopper = threading.Thread(target=r.worker.stop)
    stopper.start()
    deadline = time.monotonic() + LONG
    while r.worker.dropped == 0 and time.monotonic() < deadline:
        pass
    r.proceed.release()
    stopper.join(LONG)
    assert not stopper.is_alive()
    assert [item for item, _ in r.results] == ['under way']
    assert r.worker.dropped == 1
    assert 'idem_worker' not in {thread.name for thread in threading.enumerate()}


def test_input_after_stop_is_counted_as_dropped_and_stop_may_be_repeated(recorder):
    r = recorder()
    r.worker.stop()
    r.worker.submit('too late')
    r.worker.stop()
    assert r.results == []
    assert r.worker.dropped == 1


def test_paused_worker_keeps_the_newest_input_and_takes_it_when_it_goes_on(recorder):
    r = recorder()
    r.worker.pause(True)
    for item in ('first', 'second', 'newest'):
        r.worker.submit(item)
    assert (r.worker.dropped, r.worker.waiting, r.worker.is_busy) == (2, 1, False)
    assert r.worker.call_soon(lambda: r.results).result(LONG) == []
    r.worker.pause(False)
    r.run_next()
    assert [item for item, _ in r.results] == ['newest']
    assert r.worker.waiting == 0


def test_task_is_called_in_the_thread_even_while_paused(recorder):
    r = recorder()
    r.worker.pause(True)
    name = r.worker.call_soon(lambda: threading.current_thread().name)
    assert name.result(LONG) == 'idem_worker'


def test_task_comes_before_the_next_input_and_drops_none(recorder):
    r = recorder()
    r.worker.submit('under way')
    assert r.started.acquire(timeout=LONG)
    r.worker.submit('next')
    future = r.worker.call_soon(lambda: [item for item, _ in r.results])
    r.run_next()
    assert future.result(LONG) == ['under way']
    r.run_next()
    assert [item for item, _ in r.results] == ['under way', 'next']
    assert r.worker.dropped == 0


def test_task_may_take_what_waits_and_do_the_work_on_it(recorder):
    r = recorder()
    r.worker.pause(True)
    r.worker.submit('waiting')
    r.proceed.release()
    r.worker.call_soon(lambda: r.work(r.worker.take_waiting())).result(LONG)
    assert r.results == [('waiting', 'waiting')]
    assert r.worker.call_soon(r.worker.take_waiting).result(LONG) is None
    assert r.worker.dropped == 0


def test_error_in_a_task_is_its_callers_and_the_thread_lives_on(recorder):
    r = recorder()
    with pytest.raises(ZeroDivisionError):
        r.worker.call_soon(lambda: 1 / 0).result(LONG)
    assert r.worker.call_soon(lambda: 'alive').result(LONG) == 'alive'


def test_stop_cancels_tasks_that_were_not_begun(recorder):
    r = recorder()
    r.worker.submit('under way')
    assert r.started.acquire(timeout=LONG)
    future = r.worker.call_soon(pytest.fail)
    stopper = threading.Thread(target=r.worker.stop)
    stopper.start()
    with pytest.raises(CancelledError):
        future.result(LONG)
    r.proceed.release()
    stopper.join(LONG)
    assert not stopper.is_alive()
    assert r.worker.call_soon(pytest.fail).cancelled()


def test_a_thousand_starts_and_stops_leave_no_thread_and_lose_no_count():
    before = threading.active_count()
    taken = dropped = 0
    for _ in range(1000):
        results = []
        worker = LatestOnlyWorker(results.append)
        worker.submit(1)
        worker.submit(2)
        worker.stop()
        taken, dropped = taken + len(results), dropped + worker.dropped
    assert taken + dropped == 2000
    assert threading.active_count() == before


def test_what_is_left_for_idle_times_waits_for_inputs_and_a_newer_one_takes_its_place(recorder):
    r = recorder()
    ended = threading.Event()
    r.worker.submit('under way')
    assert r.started.acquire(timeout=LONG)
    r.worker.when_idle(lambda: r.results.append('older'))
    r.worker.when_idle(lambda: (r.results.append('idle'), ended.set()))
    r.worker.submit('next')
    r.run_next()
    r.run_next()
    assert ended.wait(LONG)
    assert [each[0] if isinstance(each, tuple) else each for each in r.results] == [
        'under way',
        'next',
        'idle',
    ]


AT_WORK = """
import atexit, sys, threading
from idem_ros.node.process import leave
from idem_ros.node.worker import LatestOnlyWorker

atexit.register(lambda: print('ended in order'))
begun = threading.Event()
worker = LatestOnlyWorker(lambda item: (begun.set(), threading.Event().wait()))
worker.submit(1)
begun.wait()
worker.stop(patience=0.01)
sys.exit(leave(3))
"""


def test_work_that_does_not_end_is_ended_with_the_process():
    ended = subprocess.run(
        [sys.executable, '-c', AT_WORK], capture_output=True, text=True, timeout=4 * LONG
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (3, '', '')
