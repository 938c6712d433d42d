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


def twist_at_time(when, measured, neighbours, config):
    """Return the twist (6,) x y z [m/s] rx ry rz [rad/s] of a sensor; None: unknown.

    With two neighbours it may change evenly: in a bend each sweep is smeared differently, and one
    twist for all would be wrong by half of the change.

    Args:
        when: [s] after the cloud's stamp.
        measured: `Measured`, the times after its own stamp, as of all of them.
        neighbours: one or two other clouds of the same sensor, each with how much later it is [s].
        config: `RegistrationConfig`.
    """
    track = sorted([(0.0, measured), *((late, each) for each, late in neighbours)], key=_stamp)
    stamps = np.array([stamp for stamp, _ in track])
    middles = stamps + [_middle(each) for _, each in track]
    steps, rates = [None] * (len(track) - 1), np.zeros((len(track) - 1, 6))
    for _ in range(ROUNDS):  # what the motion smears is undone by what was found of it before
        twists = _even_change(stamps, rates, middles)
        clouds = [
            at_one_time(each, np.eye(4), w) for (_, each), w in zip(track, twists, strict=True)
        ]
        steps = [
            step_between(*pair, config, guess)
            for *pair, guess in zip(clouds, clouds[1:], steps, strict=False)
        ]
        if any(step is None for step in steps):
            return twist_at_time(when, measured, neighbours[:1], config) if steps[1:] else None
        rates = np.array([se3.log(step)[ORDER] for step in steps]) / np.diff(stamps)[:, None]
    return _even_change(stamps, rates, np.array([when]))[0]


def _stamp(of_track):
    return of_track[0]


def _middle(measured):
    return 0.0 if measured.times is None else float(np.mean(measured.times))


def _even_change(stamps, rates, times):
    """Return the twists (K, 6) at times, given the mean rates (n, 6) between stamps."""
    between = (stamps[1:] + stamps[:-1]) / 2
    if len(rates) == 1:
        return np.repeat(rates, len(times), axis=0)
    change = (rates[1] - rates[0]) / (between[1] - between[0])
    return rates[0] + (np.asarray(times) - between[0])[:, None] * change


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
