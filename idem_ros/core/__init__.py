"""The metric and its solver: arrays in, numbers out; no ROS, no files."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import IdemError, InvalidCloud, InvalidConfig, InvalidTransform

if TYPE_CHECKING:  # for editors and type checkers: the same as below
    from idem_ros.core.compilation import warm_up as warm_up
    from idem_ros.core.geometry.undistortion import undistort as undistort
    from idem_ros.core.maps.map_cloud import MapCloud as MapCloud
    from idem_ros.core.metric.cloud import Cloud as Cloud
    from idem_ros.core.metric.landscape import Landscape as Landscape
    from idem_ros.core.metric.q_tot import fourth_neighbor_distance as fourth_neighbor_distance
    from idem_ros.core.metric.q_tot import q_per_point as q_per_point
    from idem_ros.core.metric.q_tot import q_tot as q_tot
    from idem_ros.core.metric.q_tot import search_radius as search_radius
    from idem_ros.core.metric.region_of_interest import region_along_axes as region_along_axes
    from idem_ros.core.metric.region_of_interest import region_on_grid as region_on_grid
    from idem_ros.core.registration import register as register
    from idem_ros.core.result import RegistrationResult as RegistrationResult
    from idem_ros.core.several.joint_registration import register_all as register_all
    from idem_ros.core.several.joint_result import CloudVerdict as CloudVerdict
    from idem_ros.core.several.joint_result import Edge as Edge
    from idem_ros.core.several.joint_result import JointResult as JointResult
    from idem_ros.core.several.pose_graph import PoseGraph as PoseGraph
    from idem_ros.core.several.pose_graph import solve_graph as solve_graph
    from idem_ros.core.several.problem import PosePrior as PosePrior
    from idem_ros.core.solve.newton import Termination as Termination
    from idem_ros.core.status import Status as Status
    from idem_ros.core.trust.verdict import Assessment as Assessment
    from idem_ros.core.trust.verdict import Verdict as Verdict
    from idem_ros.core.trust_tuning import TrustTuning as TrustTuning
    from idem_ros.core.tuning import SolverTuning as SolverTuning

# Loaded when they are first used: numba takes half a second, which `idem --help` need not wait.
_LOADED_LATER = {
    'Cloud': 'metric.cloud',
    'MapCloud': 'maps.map_cloud',
    'Assessment': 'trust.verdict',
    'RegistrationResult': 'result',
    'Status': 'status',
    'Termination': 'solve.newton',
    'SolverTuning': 'tuning',
    'TrustTuning': 'trust_tuning',
    'Verdict': 'trust.verdict',
    'fourth_neighbor_distance': 'metric.q_tot',
    'q_per_point': 'metric.q_tot',
    'q_tot': 'metric.q_tot',
    'register': 'registration',
    'register_all': 'several.joint_registration',
    'JointResult': 'several.joint_result',
    'CloudVerdict': 'several.joint_result',
    'Edge': 'several.joint_result',
    'PosePrior': 'several.problem',
    'PoseGraph': 'several.pose_graph',
    'solve_graph': 'several.pose_graph',
    'search_radius': 'metric.q_tot',
    'Landscape': 'metric.landscape',
    'region_along_axes': 'metric.region_of_interest',
    'region_on_grid': 'metric.region_of_interest',
    'undistort': 'geometry.undistortion',
    'warm_up': 'compilation',
}

__all__ = [
    'IdemError',
    'InvalidCloud',
    'InvalidConfig',
    'InvalidTransform',
    'RegistrationConfig',
    *_LOADED_LATER,  # pyright: ignore[reportUnsupportedDunderAll]
]


def __getattr__(name: str) -> Any:
    if name not in _LOADED_LATER:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_LOADED_LATER[name]}'), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LOADED_LATER})
