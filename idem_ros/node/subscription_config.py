"""How the node subscribes to its three inputs: the parameters that only a live node has."""

from dataclasses import dataclass, field

from idem_ros.core.exceptions import InvalidConfig

RELIABILITIES = ('best_effort', 'reliable')
DURABILITIES = ('volatile', 'transient_local')


def _parameter(default, description):
    return field(default=default, metadata={'description': description, 'unit': ''})


@dataclass(frozen=True)
class SubscriptionConfig:
    """Quality of service of the node's subscriptions, fixed when it starts."""

    reliability: str = _parameter(
        'best_effort',
        'of all three inputs: "best_effort" hears every publisher, but may lose large clouds '
        '(config/fastdds_large_clouds.xml helps); "reliable" has what was lost sent again, but '
        'is deaf to publishers that offer best effort only',
    )
    depth: int = _parameter(
        5, 'messages of each input that may wait while the node is busy taking another'
    )
    target_durability: str = _parameter(
        'volatile',
        'of the target: "transient_local" also receives a latched map that was published before '
        'the node started (and is then always reliable), but is deaf to volatile publishers',
    )

    def __post_init__(self):
        _require_one_of('reliability', self.reliability, RELIABILITIES)
        _require_one_of('target_durability', self.target_durability, DURABILITIES)
        is_whole = isinstance(self.depth, int) and not isinstance(self.depth, bool)
        if not (is_whole and self.depth >= 1):
            raise InvalidConfig(f'depth is {self.depth!r}; it must be a whole number from 1')


def _require_one_of(name, value, words):
    if value not in words:
        raise InvalidConfig(f'{name} is {value!r}; it must be one of {words}')
