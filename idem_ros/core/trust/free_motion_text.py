"""Free motions in words: 'free along x and about z'."""

import numpy as np

from idem_ros.core.arrays import Floats, RotationMatrix
from idem_ros.core.trust.observability import Observability

AXES = 'xyz'
MOSTLY_TURN = 0.5  # of a unit motion: from here on it is named by its turn
ON_AXIS = 0.95  # of an axis within a subspace: from here on the subspace is named by its axes


def free_in_words(observability: Observability, R_target_source: RotationMatrix) -> str:
    """Say which motions are unobservable.

    Args:
        observability: the `Observability` at the pose.
        R_target_source: (3, 3), so that the directions are those of the source's axes.

    Returns:
        A phrase; empty where none is free.
    """
    if observability.observable.all():
        return ''
    scaled = np.linalg.solve(observability.units, observability.free)
    turns, moves = scaled[:3], scaled[3:]
    _, share, mixed = np.linalg.svd(turns)
    share = np.pad(share, (0, len(mixed) - len(share)))
    is_turn = share > MOSTLY_TURN
    said = [
        f'{how} {named(R_target_source.T @ vectors @ mixed[chosen].T)}'
        for how, vectors, chosen in (('along', moves, ~is_turn), ('about', turns, is_turn))
        if chosen.any()
    ]
    return f'free {" and ".join(said)}'


def named(directions: Floats) -> str:
    """Name the span of (3, k) directions by axes where it has them, else by its directions."""
    basis, _ = np.linalg.qr(directions)
    on_axis = np.linalg.norm(basis, axis=1) > ON_AXIS
    if on_axis.sum() == basis.shape[1]:
        return ' and '.join(AXES[i] for i in np.flatnonzero(on_axis))
    return ' and '.join('(' + ', '.join(f'{x:.2f}' for x in column) + ')' for column in basis.T)
