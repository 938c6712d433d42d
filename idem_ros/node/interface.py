"""The node's topics and parameters in words: what it declares, and the reference's tables say."""

from dataclasses import Field, dataclass, fields, replace

from idem_ros.calibration.config import DECIDED, RigWatchConfig
from idem_ros.core.config import RegistrationConfig
from idem_ros.node.config import CapsuleConfig, OutputConfig, SubscriptionConfig
from idem_ros.pairing.guesses import FOLLOWING, HEARD, POSE, TF, GuessConfig
from idem_ros.pairing.map_target import MapConfig
from idem_ros.pairing.targets import PairingConfig
from idem_ros.pairing.turn_rates import IMU
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig


@dataclass(frozen=True)
class Topic:
    """A topic or a service of the node."""

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
POSE_INPUTS = {
    'initial_pose': Topic(
        '/initialpose',
        POSE,
        'with initial_guess.type initial_pose or last: the pose to start from, whenever one '
        'comes, as of RViz\'s "2D Pose Estimate"; of the source frame, whatever its stamp',
    ),
}
IMU_INPUTS = {
    'imu': Topic(
        '~/imu',
        IMU,
        'with a motion to be undone: its angular rates tell how the sensor turned during a sweep; '
        'in the frame of the source, or with initial_guess.type tf in one that tf knows',
    ),
}
EVERY_INPUT = (*INPUTS, *POSE_INPUTS, *TF_INPUTS, *IMU_INPUTS)
OUTPUTS = {
    'transform': Topic(
        '~/transform',
        'geometry_msgs/msg/TransformStamped',
        'the refined pose of the source frame (child) in the target frame, with the stamp of '
        'the source; of every result, or with publish aligned of those that can be built upon',
    ),
    'pose_with_covariance': Topic(
        '~/pose_with_covariance',
        'geometry_msgs/msg/PoseWithCovarianceStamped',
        'the same pose; a variance of 1e6 (m2, rad2) says that nothing is known of it',
    ),
    'q_tot': Topic('~/q_tot', 'std_msgs/msg/Float64', 'q_tot at the refined pose'),
    'aligned': Topic(
        '~/debug/aligned',
        'sensor_msgs/msg/PointCloud2',
        'the points of the source that took part, in the target frame; made while somebody '
        'subscribes',
    ),
    'undistorted': Topic(
        '~/undistorted',
        'sensor_msgs/msg/PointCloud2',
        'the points of the source that took part, in its own frame at motion_reference, with the '
        'motion of the sweep undone; made while somebody subscribes, where it is undone',
    ),
    'q_points': Topic(
        '~/debug/q_points',
        'sensor_msgs/msg/PointCloud2',
        'the points (or voxel means) of both clouds in the target frame, each with its share q_i '
        'of q_tot; field cloud is 0 for the target, 1 for the source; made while somebody '
        'subscribes',
    ),
    'region_of_interest': Topic(
        '~/debug/region_of_interest',
        'nav_msgs/msg/OccupancyGrid',
        'on request: q_tot of the last pair where the source is shifted along x and y, from its '
        'least value (0) to its greatest (100)',
    ),
    'diagnostics': Topic(
        '/diagnostics',
        'diagnostic_msgs/msg/DiagnosticArray',
        '"registration": of each result q_tot, q_mean, overlap, radius, iterations, status and '
        'reason, milliseconds of each stage, points; what was refused and why; what the node '
        'waits for. "load", every second: rates, losses, delays, sources received, answered, '
        'refused, waiting and dropped, utilisation of the worker',
    ),
}
TF_OUTPUT = Topic(
    '/tf', TF, 'with publish_tf: results that are aligned, along every motion that the clouds hold'
)
SERVICES = {
    'refine_once': Topic(
        '~/refine_once',
        'std_srvs/srv/Trigger',
        'refine the newest complete pair now, once more or although the node is paused; answers '
        'what came of it',
    ),
    'pause': Topic(
        '~/pause',
        'std_srvs/srv/SetBool',
        'true: refine nothing until false; the newest complete pair is kept, older ones are '
        'dropped and counted',
    ),
    'reset': Topic(
        '~/reset',
        'std_srvs/srv/Trigger',
        'with initial_guess.type initial_pose or last: forget the last result; initial_pose then '
        'waits for another pose, last begins with the one given last',
    ),
    'publish_region_of_interest': Topic(
        '~/publish_region_of_interest',
        'std_srvs/srv/Trigger',
        'evaluate ~/debug/region_of_interest around the last result; nothing is refined meanwhile',
    ),
}
CONFIGS = (
    RegistrationConfig,
    PreprocessingConfig,
    PointTimeConfig,
    PairingConfig,
    GuessConfig,
    MapConfig,
    OutputConfig,
    CapsuleConfig,
    SubscriptionConfig,
)
RIG_CONFIGS = RigWatchConfig, RegistrationConfig, PreprocessingConfig, PointTimeConfig
RIG_DECIDED = (*DECIDED, 'crop_target', 'budget_ms')
RIG_OUTPUT = Topic(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    '"extrinsics", every second and of each instant: OK where every sensor is where it was '
    'calibrated; WARN where one has moved, with how far and by how many standard deviations, or '
    'cannot be told; ERROR where nothing can be said, and why; STALE where no clouds come',
)


def inputs_with(guess_type: str) -> dict[str, Topic]:
    """Return the topics that a node listens to whose guesses come so, see `GuessConfig`."""
    inputs = {name: topic for name, topic in INPUTS.items() if name != 'initial_guess'}
    if guess_type in HEARD:
        inputs['initial_guess'] = replace(INPUTS['initial_guess'], msgtype=HEARD[guess_type])
    more = TF_INPUTS if guess_type == 'tf' else POSE_INPUTS if guess_type in FOLLOWING else {}
    return {**inputs, **more, **IMU_INPUTS}


def parameter_fields() -> list[Field]:
    """Return the fields behind the node's parameters, in the order they are declared."""
    return [field for config_type in CONFIGS for field in fields(config_type)]
