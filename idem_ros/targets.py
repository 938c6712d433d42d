"""Which target a source is registered to, by the stamps of both."""

from collections import deque
from dataclasses import dataclass

from idem_ros.core.exceptions import IdemError
from idem_ros.parameters import parameter, require_one_of, require_positive
from idem_ros.stamps import NotYet, seconds
from idem_ros.transform_message import stamp_ns

PAIRINGS = ('latched', 'nearest', 'newest')
KEPT = 8


class NoTarget(IdemError):
    """A source that no target is near enough to."""


@dataclass(frozen=True)
class PairingConfig:
    """Which target a source is registered to."""

    pairing: str = parameter(
        'latched',
        'target of a source: "latched" (the newest that is not after it, else the last received: '
        'a map, or the scan before), "nearest" (in time, once one of its stamp or later has '
        'come), "newest" (of those received, whatever its stamp)',
        choices=PAIRINGS,
    )
    pairing_tolerance: float = parameter(
        0.05, 'with nearest: a source is refused whose target is farther from its stamp', 's'
    )

    def __post_init__(self):
        require_one_of('pairing', self.pairing, PAIRINGS)
        require_positive('pairing_tolerance', self.pairing_tolerance)


class Targets:
    """The targets received last."""

    def __init__(self):
        self._kept = deque(maxlen=KEPT)

    def __bool__(self):
        return bool(self._kept)

    def add(self, message):
        """Keep a target cloud."""
        self._kept.append(message)

    def forget_after(self, stamp, config):
        """Forget what is later than a stamp [ns], but for a map, which need not come again."""
        earlier = [target for target in self._kept if stamp_ns(target) <= stamp]
        last = [] if config.pairing == 'nearest' else list(self._kept)[-1:]
        self._kept = deque(earlier or last, maxlen=KEPT)

    def of_source(self, stamp, config):
        """Return the target of a source of a stamp [ns].

        Of targets with the same stamp it is the one received last.

        Raises:
            NotYet: it may still come.
            NoTarget: none is near enough.
        """
        if not self._kept:
            raise NotYet('none has come')
        received = list(reversed(self._kept))  # max() and min() keep the first that they meet
        if config.pairing == 'nearest':
            return _nearest(received, stamp, config.pairing_tolerance)
        if config.pairing == 'newest':
            return max(received, key=stamp_ns)
        earlier = [target for target in received if stamp_ns(target) <= stamp]
        return max(earlier, key=stamp_ns) if earlier else received[0]


def _nearest(received, stamp, tolerance):
    newest = max(map(stamp_ns, received))
    if newest < stamp:
        raise NotYet(f'the newest is {seconds(stamp - newest)} older than the source')
    nearest = min(received, key=lambda target: abs(stamp_ns(target) - stamp))
    off = abs(stamp_ns(nearest) - stamp)
    if off > tolerance * 1e9:
        raise NoTarget(
            f'the nearest target is {seconds(off)} off the source; '
            f'pairing_tolerance is {tolerance:g} s'
        )
    return nearest
