"""The process of a node: the command that starts it, how it is asked to end, and ends.

It compiles its kernels so that it can end meanwhile.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import Future, TimeoutError

from idem_ros.core.exceptions import IdemError
from idem_ros.node.worker import NAME

POLL = 0.1  # [s] from a signal to the end, at most
_received: list[int] = []
_compiling = threading.Event()
NODE = [sys.executable, '-m', 'idem_ros.node.entry']
END_PATIENCE = 10.0  # [s]


class AskedToEnd(IdemError):
    """A signal came while the node was not ready yet."""


def note_signals() -> None:
    """Take note of SIGINT and SIGTERM from now on."""
    for signum in (signal.SIGINT, signal.SIGTERM):
        # it raises nothing: inside an import or a compilation that would come out as another
        # error, or crash. Nor is it left to rclpy, which pulls the context from under the executor
        signal.signal(signum, lambda signum, frame: _received.append(signum))


def is_asked_for() -> bool:
    """Whether a signal has come since `note_signals`."""
    return bool(_received)


def warm_up(motion: str) -> None:
    """Compile every kernel, or load it, in a thread of its own: a signal need not wait for it.

    Args:
        motion: see `core.warm_up`.

    Raises:
        AskedToEnd: a signal came first; the thread goes on, and `leave` ends it with the process.
    """
    done: Future = Future()
    # daemon: an exception on its way out of the process must not wait for it
    threading.Thread(
        target=_settle, args=(done, motion), name='idem_compiler', daemon=True
    ).start()
    while not is_asked_for():
        try:
            return done.result(timeout=POLL)
        except TimeoutError:
            continue
    raise AskedToEnd('asked to end while kernels were compiled')


def leave(code: int) -> int:
    """Return an exit code, or end at once with it where a thread still compiles or registers.

    An interpreter that ends in order pulls the memory of kernels from under that thread.
    """
    if _compiling.is_set() or any(each.name == NAME for each in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


def _settle(done: Future, motion: str) -> None:
    from idem_ros.core import warm_up  # late: numba takes seconds where the disk is slow

    _compiling.set()
    try:
        done.set_result(warm_up(motion))
    except Exception as error:
        done.set_exception(error)
    finally:
        _compiling.clear()


def node_command(parameters: dict, log_level: str = 'error') -> list[str]:
    """Return the command of a node with parameters; other arguments of ROS may follow."""
    command = [*NODE, '--ros-args', '--log-level', f'idem_node:={log_level}']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={json.dumps(value)}']
    return command


def ended(child: subprocess.Popen) -> int:
    """Ask a process to end, make it where it does not; return its exit code."""
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(END_PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
    return child.wait()
