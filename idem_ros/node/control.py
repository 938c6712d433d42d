"""The node's services: asked by hand, or by the program that supervises the robot."""

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, NamedTuple

from rclpy import task
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from idem_ros.node.interface import SERVICES
from idem_ros.node.messages import message_class
from idem_ros.node.unforeseen import reason_of
from idem_ros.refinement.diagnostics import headline
from idem_ros.refinement.outcome import Refinement


class Answer(NamedTuple):
    """What a service answers."""

    success: bool
    message: str


def what_came_of(refinement: Refinement) -> Answer:
    """Say what came of a refinement that was asked for."""
    result = refinement.result
    seconds, nanoseconds = divmod(refinement.stamp, 10**9)
    return Answer(
        result.is_usable,
        f'{headline(result)}; {result.status.value}: q_tot {result.q_tot:.6g} nat, '
        f'overlap {result.overlap:.3g}, {refinement.time_ms:.1f} ms, '
        f'stamp {seconds}.{nanoseconds:09d}',
    )


class Control:
    """Offers the services; what takes long is awaited while the executor goes on.

    Args:
        node: offers them.
        pause: called with True or False.
        asked: {service: returns at once a future of its `Answer`}.
    """

    def __init__(
        self,
        node: Node,
        pause: Callable[[bool], Answer],
        asked: dict[str, Callable[[], Future]],
    ):
        self._node = node
        self._group = ReentrantCallbackGroup()  # one that waits must not keep clouds from coming
        callbacks = {name: self._awaiting(ask) for name, ask in asked.items()}
        callbacks['pause'] = lambda request, response: _filled(response, pause(request.data))
        self._services = [
            node.create_service(
                message_class(SERVICES[name].msgtype),
                SERVICES[name].name,
                callback,
                callback_group=self._group,
            )
            for name, callback in callbacks.items()
        ]

    def close(self) -> None:
        """Offer them no longer."""
        for service in self._services:
            self._node.destroy_service(service)

    def _awaiting(self, ask: Callable[[], Future]) -> Callable:
        async def on_request(request: Any, response: Any) -> Any:
            future = ask()
            await self._ended(future)
            return _filled(response, answer_of(future))

        return on_request

    def _ended(self, future: Future) -> task.Future:
        """Return what the executor can await: done when the future is, which wakes it up."""
        ended = task.Future()

        def end(_):
            ended.set_result(None)
            executor = self._node.executor
            if executor is not None:
                with suppress(RuntimeError):  # of rclpy's InvalidHandle: it is being shut down
                    executor.wake()

        future.add_done_callback(end)
        return ended


def answer_of(future: Future) -> Answer:
    """Return the answer in a future that is done; an error is one, too."""
    if future.cancelled():
        return Answer(False, 'the node was stopped before it came to that')
    error = future.exception()
    if error is None:
        return future.result()
    return Answer(False, reason_of(error))


def answered(answer: Answer) -> Future:
    """Return a future that is done."""
    future: Future = Future()
    future.set_result(answer)
    return future


def _filled(response: Any, answer: Answer) -> Any:
    response.success, response.message = bool(answer.success), str(answer.message)
    return response
