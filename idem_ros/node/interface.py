"""The node's topics and parameters in words: what it declares, and the README's table says."""

from dataclasses import Field, dataclass, fields, replace

from idem_ros.core.config import RegistrationConfig
from idem_ros.guesses import STREAMED, TF, GuessConfig
from idem_ros.node.subscription_config import SubscriptionConfig
from idem_ros.preprocessing import PreprocessingConfig
from idem_ros.targets import PairingConfig


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
        'where the source frame (child) is in the target frame, with the stamp of a source, or '
        'before and after it; stamp 0 serves every source. As initial_guess.type says it may be a '
        'PoseWithCovarianceStamped or an Odometry',
    ),
}
TF_INPUTS = {
    'tf': Topic('/tf', TF, 'with initial_guess.type tf: transforms that change'),
    'tf_static': Topic('/tf_static', TF, 'with initial_guess.type tf: transforms that do not'),
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
        'q_tot, q_mean, overlap, radius, iterations, status, milliseconds, points, dropped; '
        'what was refused and why; what the node waits for',
    ),
}
CONFIGS = (
    RegistrationConfig,
    PreprocessingConfig,
    PairingConfig,
    GuessConfig,
    SubscriptionConfig,
)


def inputs_with(guess_type: str) -> dict[str, Topic]:
    """Return the topics that a node listens to whose guesses come so, see `GuessConfig`."""
    inputs = {name: topic for name, topic in INPUTS.items() if name != 'initial_guess'}
    if guess_type in STREAMED:
        inputs['initial_guess'] = replace(INPUTS['initial_guess'], msgtype=STREAMED[guess_type])
    return {**inputs, **(TF_INPUTS if guess_type == 'tf' else {})}


def parameter_fields() -> list[Field]:
    """Return the fields behind the node's parameters, in the order they are declared."""
    return [field for config_type in CONFIGS for field in fields(config_type)]
