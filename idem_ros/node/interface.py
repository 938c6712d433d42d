"""The node's topics and parameters in words: what it declares, and the README's table says."""

from dataclasses import Field, dataclass, fields
from typing import Any

from idem_ros.core.config import RegistrationConfig
from idem_ros.node.subscription_config import SubscriptionConfig


@dataclass(frozen=True)
class Topic:
    """A topic of the node."""

    name: str
    msgtype: str
    description: str


INPUTS = {
    'target': Topic(
        '~/target',
        'sensor_msgs/msg/PointCloud2',
        'the cloud to register to: a stream, or a map that arrives once',
    ),
    'source': Topic('~/source', 'sensor_msgs/msg/PointCloud2', 'the cloud to register'),
    'initial_guess': Topic(
        '~/initial_guess',
        'geometry_msgs/msg/TransformStamped',
        'where the source frame (child) is in the target frame, with the stamp of a source; '
        'stamp 0 serves every source',
    ),
}
OUTPUTS = {
    'transform': Topic(
        '~/transform',
        'geometry_msgs/msg/TransformStamped',
        'the refined pose of the source frame (child) in the target frame, with the stamp of '
        'the source',
    ),
    'q_tot': Topic('~/q_tot', 'std_msgs/msg/Float64', 'q_tot at the refined pose'),
    'diagnostics': Topic(
        '/diagnostics',
        'diagnostic_msgs/msg/DiagnosticArray',
        'q_tot, q_mean, overlap, radius, iterations, status, milliseconds, dropped; '
        'what was refused and why; what the node waits for',
    ),
}
CONFIGS = (RegistrationConfig, SubscriptionConfig)


def parameter_fields() -> list[Field]:
    """Return the fields behind the node's parameters, in the order they are declared."""
    return [field for config_type in CONFIGS for field in fields(config_type)]


def default_of(field: Field) -> Any:
    """Return a field's default as ROS can hold it: a list for a tuple, 0.0 for None."""
    if field.default is None:
        return 0.0
    return list(field.default) if isinstance(field.default, tuple) else field.default


def description_of(field: Field) -> str:
    """Return a field's description with its unit, and with what 0.0 means where that is none."""
    unit = f' [{field.metadata["unit"]}]' if field.metadata['unit'] else ''
    none = '; 0.0 means none' if field.default is None else ''
    return f'{field.metadata["description"]}{unit}{none}'
