"""The parameters that only a live node has: its inputs, its outputs, its capsules."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, require_fields

NOT_ALIGNED, REFUSED, LATE, ALL = WHEN = ('not_aligned', 'refused', 'late', 'all')

ALIGNED = 'aligned'
PUBLISHED = ('all', ALIGNED)

RELIABILITIES = ('best_effort', 'reliable')
AUTO = 'auto'
DURABILITIES = (AUTO, 'volatile', 'transient_local')


@dataclass(frozen=True)
class CapsuleConfig:
    """When a source is written to disk with all that it was refined from."""

    folder: str = parameter(
        '',
        'folder for capsules: recordings of one source each, with target, guess, result, '
        'parameters and the last ten diagnostics, for `idem show` and `idem replay`; it is made '
        'where its parent exists; empty: none are written',
        name='capsules.folder',
    )
    when: str = parameter(
        NOT_ALIGNED,
        'of which sources: "not_aligned" (whose verdict is another, and refused ones), "refused", '
        '"late" (that ran out of budget_ms) or "all"',
        name='capsules.when',
        choices=WHEN,
    )
    most: int = parameter(
        100, 'capsules that are kept; the oldest goes first', name='capsules.most'
    )
    most_mb: int = parameter(
        1000, 'that they may hold together; the oldest goes first', 'MB', name='capsules.most_mb'
    )

    def __post_init__(self):
        require_fields(self)
        if '\0' in self.folder:
            raise InvalidConfig(f'capsules.folder is {self.folder!r}; it must name a folder')


@dataclass(frozen=True)
class OutputConfig:
    """Which results are published, and where else than on the node's topics."""

    publish: str = parameter(
        'all',
        'which results go out on ~/transform and ~/pose_with_covariance: "all", whatever their '
        'verdict, which the diagnostics tell; "aligned": those only that publish_tf broadcasts',
        choices=PUBLISHED,
    )
    publish_tf: bool = parameter(
        False,
        'whether results that are aligned, along every motion that the clouds hold (assessment '
        'none: that converged), are broadcast on /tf, too, as the transform from the frame of the '
        'target to that of the source; a frame has one parent only: nobody else may broadcast it',
    )

    def __post_init__(self):
        require_fields(self)


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
