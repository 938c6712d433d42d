"""Whether an audited pose is near enough to the minimum beside it: within a tolerance.

A pose is not wrong because it is not the minimum to a millimetre. The last stage is followed from
it; the verdict is that on the minimum, and how far off it the pose is decides with it.
"""

from __future__ import annotations

from dataclasses import replace
from math import erf, hypot, sqrt

import numpy as np

from idem_ros.core.arrays import Floats, Matrix6, Transform, Twist
from idem_ros.core.geometry import se3
from idem_ros.core.trust.observability import Observability
from idem_ros.core.trust.verdict import LEAST_PROBABILITY, Assessment, Verdict


def offset_of(T: Transform, T_minimum: Transform, observability: Observability) -> Twist:
    """Return the twist (omega, v) from the minimum to a pose, along motions that are observable.

    T, T_minimum: (4, 4), between the clouds' origins.
    """
    along = np.linalg.solve(observability.motions, se3.log(T @ se3.inverse(T_minimum)))
    along[~observability.observable] = 0.0
    moved: Twist = observability.motions @ along
    return moved


def share_within(offset: Floats, covariance: Matrix6, tolerance: tuple[float, ...]) -> float:
    """Return how likely a pose is within a tolerance of the truth, 0 to 1.

    Args:
        offset: (6,) x y z rx ry rz of the pose from the minimum.
        covariance: (6, 6) of the minimum's own error along observable motions, likewise.
        tolerance: a length, and an angle [deg].
    """
    share = 1.0
    for part, most in ((slice(0, 3), tolerance[0]), (slice(3, 6), np.radians(tolerance[1]))):
        off, spread = offset[part], covariance[part, part]
        far = hypot(*off)
        direction = off / far if far > 0.0 else np.linalg.eigh(spread)[1][:, -1]
        sigma = sqrt(max(float(direction @ spread @ direction), 1e-300))
        share *= _normal((most - far) / sigma) - _normal((-most - far) / sigma)
    return share


def audited(
    assessment: Assessment, offset: Floats, covariance: Matrix6, tolerance: tuple[float, ...]
) -> Assessment:
    """Return what the `Assessment` of the minimum beside an audited pose says of the pose.

    Args as `share_within`; assessment: that of the minimum.
    """
    share = share_within(offset, covariance, tolerance)
    assessment = replace(
        assessment,
        p_aligned=assessment.p_aligned * share,
        covariance=assessment.covariance + np.outer(offset, offset),
        offset=offset,
    )
    is_good = assessment.verdict in (Verdict.ALIGNED, Verdict.DEGENERATE)
    if not is_good or assessment.p_aligned >= LEAST_PROBABILITY:
        return assessment
    distance, degrees = hypot(*offset[:3]), np.degrees(hypot(*offset[3:]))
    reason = (
        f'the minimum is {distance:.2g} and {degrees:.2g} deg away, where {tolerance[0]:g} and '
        f'{tolerance[1]:g} deg are tolerated'
    )
    return replace(assessment, verdict=Verdict.MISALIGNED, reason=reason)


def _normal(x: float) -> float:
    return 0.5 * (1.0 + erf(x / sqrt(2.0)))
