"""What else the node publishes: the parameters of its outputs."""

from dataclasses import dataclass

from idem_ros.core.parameter import parameter, require_fields

ALIGNED = 'aligned'
PUBLISHED = ('all', ALIGNED)


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
