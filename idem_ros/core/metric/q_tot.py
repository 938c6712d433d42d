"""The metric of the paper: the difference of joint and separate entropy, Eq. 4 to 9."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.arrays import Floats
from idem_ros.core.config import LENGTH_SCALES
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.balls import between_origins
from idem_ros.core.metric.cloud import Cloud, CloudLike, as_cloud
from idem_ros.core.metric.entropy import length_unit
from idem_ros.core.metric.joint_cloud import differences
from idem_ros.core.metric.radii import weighted_radius


def q_tot(
    target: CloudLike,
    source: CloudLike,
    T_target_source: ArrayLike | None = None,
    *,
    a: float = 1.0,
    radius: float | None = None,
    length_scale: str = 'radius',
) -> float:
    """Return q_tot, the entropy of the joint cloud minus that of its parts (Eq. 8) [nat].

    Args:
        target: (N, 3) points or a `Cloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        T_target_source: (4, 4) rigid transform from source to target frame; None: identity.
        a: search radius over the mean fourth-neighbour distance (Eq. 9).
        radius: search radius, in the clouds' unit; None: `search_radius(target, source, a)`.
        length_scale: 'radius': lengths are divided by the radius; 'none': as given, as in the
            paper. Values compare within one mode only.

    Raises:
        InvalidCloud, InvalidTransform, InvalidConfig: for what cannot be evaluated.
    """
    q_target, q_source = q_per_point(
        target, source, T_target_source, a=a, radius=radius, length_scale=length_scale
    )
    return float(np.nansum(q_target) + np.nansum(q_source))


def q_per_point(
    target: CloudLike,
    source: CloudLike,
    T_target_source: ArrayLike | None = None,
    *,
    a: float = 1.0,
    radius: float | None = None,
    length_scale: str = 'radius',
) -> tuple[Floats, Floats]:
    """Return q_i (Eq. 7) of the target's (N,) and the source's (M,) points, as for `q_tot`.

    A point that is not finite has q_i = nan.
    """
    target, source = as_cloud(target), as_cloud(source)
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    radius = (
        search_radius(target, source, a) if radius is None else checked_positive('radius', radius)
    )
    if length_scale not in LENGTH_SCALES:
        raise InvalidConfig(f'length_scale is {length_scale!r}; it must be in {LENGTH_SCALES}')
    if radius == 0.0:  # all points in one place: det Sigma = 0, and with it every entropy
        q_target, q_source = np.zeros(len(target)), np.zeros(len(source))
    else:
        pose = between_origins(target, source, T)
        scale = length_unit(length_scale, radius)
        (q_target, _), (q_source, _) = differences(
            target.points, source.points, pose, radius, scale
        )
    return _in_given_order(target, q_target), _in_given_order(source, q_source)


def fourth_neighbor_distance(points: CloudLike) -> float:
    """Return r_4th: the mean distance from a point to its fourth nearest neighbour.

    The point itself is not counted. `points` is (N, 3) or a `Cloud`, N >= 5.
    """
    return as_cloud(points).fourth_neighbor_distance()


def search_radius(target: CloudLike, source: CloudLike, a: float = 1.0) -> float:
    """Return r = a (r_4th(A) n_B + r_4th(B) n_A) / (n_A + n_B) (Eq. 9 and the text after it)."""
    return weighted_radius(checked_positive('a', a), as_cloud(target), as_cloud(source))


def checked_positive(name: str, value: Any) -> float:
    """Return a number above 0 as a float.

    Raises:
        InvalidConfig: it is none; says the name.
    """
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InvalidConfig(f'{name} is {value!r}; it must be a number above 0') from error
    if not (np.isfinite(number) and number > 0):
        raise InvalidConfig(f'{name} is {value!r}; it must be finite and above 0')
    return number


def _in_given_order(cloud: Cloud, q: Floats) -> Floats:
    if cloud.dropped == 0:
        return q
    whole = np.full(len(cloud.finite), np.nan)
    whole[cloud.finite] = q
    return whole
