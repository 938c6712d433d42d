"""What the tests of the live side share: a graph of their own, and something to wait with.

Import it before any module of messages: these look only once whether to check their fields.
"""

import os
import time
from contextlib import contextmanager

import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
rclpy = pytest.importorskip('rclpy', reason='the live side needs rclpy, which is not installed')

from idem_ros.node.environment import loopback_environment  # noqa: E402

LONG = 120.0  # seconds until a test that hangs fails; no passing test waits for it


def own_environment():
    """Return the environment of a process in a domain of its own on this machine."""
    return {**os.environ, **loopback_environment()}


@contextmanager
def own_graph():
    """Yield an rclpy context in a domain of its own; child processes inherit the domain."""
    before = dict(os.environ)
    os.environ.update(loopback_environment())
    context = rclpy.Context()
    rclpy.init(context=context)
    try:
        yield context
    finally:
        context.try_shutdown()
        os.environ.clear()
        os.environ.update(before)


def spin_until(executor, condition):
    """Turn the executor until the condition holds; fail if it never does."""
    deadline = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < deadline, f'waited {LONG} s in vain'
        executor.spin_once(timeout_sec=0.05)


def wait_for_line(stream, text):
    """Read a process's lines up to the one that holds a text; fail if it ends without."""
    for line in stream:
        if text in line:
            return line
    raise AssertionError(f'the process ended without saying {text!r}')
