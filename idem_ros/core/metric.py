"""The metric of the paper: the difference of joint and separate entropy, Eq. 4 to 9."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.cloud import as_cloud
from idem_ros.core.config import LENGTH_SCALES
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.kernels import entropy_difference


def q_tot(target, source, T_target_source=None, *, a=1.0, radius=None, length_scale='radius'):
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
    target, source, T_target_source=None, *, a=1.0, radius=None, length_scale='radius'
):
    """Return q_i (Eq. 7) of the target's (N,) and the source's (M,) points, as for `q_tot`.

    A point that is not finite has q_i = nan.
    """
    target, source = as_cloud(target), as_cloud(source)
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    radius = (
        search_radius(target, source, a) if radius is None else _checked_positive('radius', radius)
    )
    if length_scale not in LENGTH_SCALES:
        raise InvalidConfig(f'length_scale is {length_scale!r}; it must be in {LENGTH_SCALES}')
    (q_target, _), (q_source, _) = differences(target, source, T, radius, length_scale)
    return _in_given_order(target, q_target), _in_given_order(source, q_source)


def fourth_neighbor_distance(points):
    """Return r_4th: the mean distance from a point to its fourth nearest neighbour.

    The point itself is not counted. `points` is (N, 3) or a `Cloud`, N >= 5.
    """
    return as_cloud(points).fourth_neighbor_distance()


def search_radius(target, source, a=1.0):
    """Return r = a (r_4th(A) n_B + r_4th(B) n_A) / (n_A + n_B) (Eq. 9 and the text after it)."""
    target, source = as_cloud(target), as_cloud(source)
    a = _checked_positive('a', a)
    n_target, n_source = len(target), len(source)
    weighted = (
        target.fourth_neighbor_distance() * n_source + source.fourth_neighbor_distance() * n_target
    )
    return a * weighted / (n_target + n_source)


def differences(target, source, T_target_source, radius, length_scale):
    """Return (q, reach) of the target's and of the source's points, in the clouds' own order.

    Args:
        target, source: `Cloud`s, N and M points.
        T_target_source: (4, 4), between the clouds' frames as given.
        radius: in the clouds' unit, >= 0.
        length_scale: 'radius' or 'none'.

    Returns:
        Two pairs of arrays: q_i (Eq. 7) and how many points of the other cloud are in reach.
    """
    T = between_origins(target, source, T_target_source)
    return (
        _side(target, source, T, radius, length_scale),
        _side(source, target, se3.inverse(T), radius, length_scale),
    )


def between_origins(target, source, T_target_source):
    """Return the transform between the frames at the clouds' origins."""
    T = T_target_source.copy()
    T[:3, 3] += T[:3, :3] @ source.origin - target.origin
    return T


def from_origins(target, source, T):
    """Return T_target_source, given the transform between the frames at the clouds' origins."""
    T_target_source = T.copy()
    T_target_source[:3, 3] += target.origin - T[:3, :3] @ source.origin
    return T_target_source


def length_unit(length_scale, radius):
    """Return what lengths are divided by before an entropy is taken."""
    return radius if length_scale == 'radius' else 1.0


def _side(centres, others, T_centres_others, radius, length_scale):
    q, reach = np.zeros(len(centres)), np.zeros(len(centres))
    if radius == 0.0:  # all points in one place: det Sigma = 0, and with it every entropy
        return q, reach
    scale = length_unit(length_scale, radius)
    own = centres.neighbourhoods(radius, scale)
    grid = others.neighbourhoods(radius, scale).grid
    R, t = np.ascontiguousarray(T_centres_others[:3, :3]), T_centres_others[:3, 3].copy()
    sorted_q, sorted_reach = np.empty_like(q), np.empty_like(reach)
    entropy_difference(
        own.grid.points,
        own.moments,
        own.entropy,
        grid,
        R,
        t,
        radius,
        scale,
        sorted_q,
        sorted_reach,
    )
    q[own.order], reach[own.order] = sorted_q, sorted_reach
    return q, reach


def _in_given_order(cloud, q):
    if cloud.dropped == 0:
        return q
    whole = np.full(len(cloud.finite), np.nan)
    whole[cloud.finite] = q
    return whole


def _checked_positive(name, value):
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InvalidConfig(f'{name} is {value!r}; it must be a number above 0') from error
    if not (np.isfinite(number) and number > 0):
        raise InvalidConfig(f'{name} is {value!r}; it must be finite and above 0')
    return number
