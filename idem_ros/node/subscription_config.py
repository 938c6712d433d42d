"""How the node subscribes to its three inputs: the parameters that only a live node has."""

from dataclasses import dataclass

from idem_ros.core.parameter import parameter, require_fields

RELIABILITIES = ('best_effort', 'reliable')
AUTO = 'auto'
DURABILITIES = (AUTO, 'volatile', 'transient_local')


@dataclass(frozen=True)
class SubscriptionConfig:
    """Quality of service of the node's subscriptions, fixed when it starts."""

    reliability: str = parameter(
        'best_effort',
        'of all inputs: "best_effort" hears every publisher, but may lose large clouds '
        '(config/fastdds_large_clouds.xml helps); "reliable" has what was lost sent again, but '
        'is deaf to publishers that offer best effort only',
        choices=RELIABILITIES,
        fixed=True,
    )
    depth: int = parameter(
        5,
        'clouds of each input that may wait while the node is busy taking another',
        range=(1, 10_000),
        fixed=True,
    )
    target_durability: str = parameter(
        AUTO,
        'of the target: "auto" asks each publisher for what it published before the node started, '
        'where it keeps that (a latched map), and hears the others; "volatile" never asks; '
        '"transient_local" always does, and is deaf to volatile publishers',
        choices=DURABILITIES,
        fixed=True,
    )

    def __post_init__(self):
        require_fields(self)
