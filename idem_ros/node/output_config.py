"""What else the node publishes: the parameters of its outputs."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.parameters import parameter


@dataclass(frozen=True)
class OutputConfig:
    """Which outputs are published beside the topics that always are."""

    publish_tf: bool = parameter(
        False,
        'whether results that are aligned, along every motion that the clouds hold (assessment '
        'none: that converged), are broadcast on /tf, too, as the transform from the frame of the '
        'target to that of the source; a frame has one parent only: nobody else may broadcast it',
    )

    def __post_init__(self):
        if not isinstance(self.publish_tf, bool):
            raise InvalidConfig(f'publish_tf is {self.publish_tf!r}; it must be true or false')
