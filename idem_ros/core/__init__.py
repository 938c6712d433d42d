"""The metric and its solver: arrays in, numbers out; no ROS, no files."""

from idem_ros.core.cloud import Cloud
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import IdemError, InvalidCloud, InvalidConfig, InvalidTransform
from idem_ros.core.metric import fourth_neighbor_distance, q_per_point, q_tot, search_radius
from idem_ros.core.registration import RegistrationResult, Status, register
from idem_ros.core.warm_up import warm_up

__all__ = [
    'Cloud',
    'IdemError',
    'InvalidCloud',
    'InvalidConfig',
    'InvalidTransform',
    'RegistrationConfig',
    'RegistrationResult',
    'Status',
    'fourth_neighbor_distance',
    'q_per_point',
    'q_tot',
    'register',
    'search_radius',
    'warm_up',
]
