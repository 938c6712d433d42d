"""How the rig moved: from instant to instant, and while its sensors looked."""

import numpy as np

from idem_ros.core import Cloud, register
from idem_ros.core.geometry import se3
from idem_ros.core.geometry.undistortion import undistort

STILL = 0.02, 0.2  # [m/s], [deg/s]: of a rig that stands
ROUNDS = 3
ORDER = [3, 4, 5, 0, 1, 2]  # (omega, v) <-> x y z rx ry rz


def step_between(first, second, config, guess=None):
    """Return the (4, 4) pose of a sensor in the frame of its own earlier cloud; None: unknown.

    Args:
        first, second: `Cloud`s of one sensor.
        config: `RegistrationConfig`.
        guess: (4, 4); None: it stood.
    """
    result = register(first, second, guess, config)
    return result.T_target_source if result.is_usable else None


def twist_between(first, second, seconds, config):
    """Return the twist (6,) x y z [m/s] rx ry rz [rad/s] of a sensor; None: unknown.

    Args:
        first, second: `Measured` of one sensor, the times of each after its own stamp.
        seconds: from the first stamp to the second; negative: the second is the earlier.
        config: `RegistrationConfig`.
    """
    step, twist = None, np.zeros(6)
    for _ in range(ROUNDS):  # what the motion smears is undone by what was found of it before
        clouds = [at_one_time(each, np.eye(4), twist) for each in (first, second)]
        step = step_between(*clouds, config, step)
        if step is None:
            return None
        twist = se3.log(step)[ORDER] / seconds
    return twist


def is_still(twist):
    """Return whether a twist (6,) is that of a rig that stands."""
    speed, rate = np.linalg.norm(twist[:3]), np.degrees(np.linalg.norm(twist[3:]))
    return bool(speed <= STILL[0] and rate <= STILL[1])


def twist_at(pose, twist):
    """Return the twist of a sensor in its own axes: twist (6,) of the rig, pose (4, 4) in it."""
    return (se3.adjoint(se3.inverse(pose)) @ twist[ORDER])[ORDER]


def at_one_time(measured, pose, twist):
    """Return the `Cloud` that a sensor would have seen at time 0, had the rig stood there.

    Args:
        measured: `Measured`.
        pose: (4, 4) of the sensor in the frame of the reference, about.
        twist: (6,) of the reference, in its own axes.
    """
    points, times = measured
    if times is None or not twist.any():
        return Cloud(points)
    return Cloud(undistort(points, times, twist_at(pose, twist), 0.0))


def places(steps, nearby):
    """Return how many of the instants are at places of their own.

    Args:
        steps: from each instant to the next, (4, 4) or None where it is unknown.
        nearby: [m], of what moved less: the same surfaces err alike.
    """
    moved = [step is None or np.linalg.norm(step[:3, 3]) > nearby for step in steps]
    return 1 + sum(moved)
