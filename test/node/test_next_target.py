"""The next map, prepared in a thread of its own."""

import queue
from types import SimpleNamespace

from idem_ros.node.worker import LARGE, NextTarget


def test_a_map_of_which_an_error_comes_that_nobody_foresaw_is_refused_and_the_next_one_taken():
    came = queue.Queue()
    wrong, right = (SimpleNamespace(width=LARGE + 1, height=1, name=n) for n in 'ab')

    def prepare(message):
        if message is wrong:
            raise ZeroDivisionError

    target = NextTarget(prepare, came.put, lambda *refused: came.put(refused))
    assert target.takes(wrong)
    message, error = came.get(timeout=60)
    assert message is wrong
    assert isinstance(error, ZeroDivisionError)
    assert target.takes(right)
    assert came.get(timeout=60) is right
    target.stop()
