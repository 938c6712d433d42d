"""The metric and its solver: arrays in, numbers out; no ROS, no files."""

from importlib import import_module

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import IdemError, InvalidCloud, InvalidConfig, InvalidTransform

# Loaded when they are first used: numba takes half a second, which `idem --help` need not wait.
_LOADED_LATER = {
    'Cloud': 'cloud',
    'Assessment': 'assessment',
    'RegistrationResult': 'result',
    'Status': 'status',
    'Termination': 'newton',
    'SolverTuning': 'tuning',
    'TrustTuning': 'tuning',
    'Verdict': 'assessment',
    'fourth_neighbor_distance': 'metric',
    'q_per_point': 'metric',
    'q_tot': 'metric',
    'register': 'registration',
    'search_radius': 'metric',
    'Landscape': 'landscape',
    'region_along_axes': 'region_of_interest',
    'region_on_grid': 'region_of_interest',
    'warm_up': 'compilation',
}

__all__ = [
    'IdemError',
    'InvalidCloud',
    'InvalidConfig',
    'InvalidTransform',
    'RegistrationConfig',
    *_LOADED_LATER,
]


def __getattr__(name):
    if name not in _LOADED_LATER:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_LOADED_LATER[name]}'), name)
