"""Sees to it that a node hears what is published to it, whatever a killed process has left."""

from collections.abc import Iterable

from idem_ros.core.exceptions import IdemError
from idem_ros.node.ports import OwnPorts
from idem_ros.node.subscriptions import Subscriptions

PATIENCE, LONGEST = 1.0, 60.0  # [s] of silence; twice as long each time
LOST = 3  # looks in a row: Fast DDS makes a port anew itself, and that takes a moment
MOST = 3  # times that a process may begin anew


class PortLost(IdemError):
    """Nobody can reach this process any more: only a new participant helps."""


class Hearing:
    """Watches inputs that have publishers; `now` is [s] of a clock that is never set back.

    Args:
        logger: of the node; it warns.

    Attributes:
        anew: how often the process began to hear anew.
        lost: how often it had to begin anew for that, with another node.
    """

    lost = 0

    def __init__(self, logger):
        self._logger = logger
        self._ports = OwnPorts()
        self._heard: set[str] = set()
        self._waits: dict[str, tuple[float, float]] = {}  # since when, and for how long
        self.anew = self.lost

    def expect(self, names: Iterable[str]) -> None:
        """Take nothing for heard of what was subscribed to just now."""
        self._heard.difference_update(names)

    def note(self, name: str) -> None:
        """Take note of a message of an input."""
        self._heard.add(name)

    def attend(self, subscriptions: Subscriptions, now: float) -> None:
        """Give this process's ports their names back; subscribe anew to what is silent too long.

        Silent is an input that was never heard although it has publishers that match.

        Raises:
            PortLost: a port has no name any more, and cannot be given it back.
        """
        if restored := self._ports.keep():
            self.anew += restored
            self._logger.warning(
                'a shared-memory port of this node had lost its name to a sender that took it for '
                "a killed process's: it has it back, and hears again"
            )
        if self._ports.lost >= LOST and Hearing.lost < MOST:
            Hearing.lost += 1
            raise PortLost(
                'a shared-memory port of this node has lost its name to a sender that took it '
                "for a killed process's: nobody reaches it"
            )
        for name in list(subscriptions.held):
            if name in self._heard or not subscriptions.could_hear(name):
                self._waits.pop(name, None)
            elif self._is_due(name, now):
                self.anew += 1
                topic = subscriptions.renew(name)
                self._logger.info(f'nothing heard on {topic}, which is published: subscribed anew')

    def close(self) -> None:
        """Let go of the ports."""
        self._ports.close()

    def _is_due(self, name: str, now: float) -> bool:
        since, patience = self._waits.setdefault(name, (now, PATIENCE))
        if now - since < patience:
            return False
        self._waits[name] = now, min(2 * patience, LONGEST)
        return True
