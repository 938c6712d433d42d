"""RMSE, Chamfer and Hausdorff of two clouds, one definition each, at many translations.

With d(p, P) the distance from a point to the nearest point of a cloud:

- RMSE P_1 -> P_2 is the root of the mean of d(p, P_2)^2 over the points p of P_1 (Eq. 2; n counts
  P_1). It is directed: P_2 -> P_1 averages over P_2.
- Chamfer is the mean of d(p, P_2) over P_1 plus the mean of d(p, P_1) over P_2: distances, not
  their squares. The paper gives no formula. With squares it would be the sum of both squared
  RMSE, and fail with them where the clouds overlap partially; table 2 has 0 mm there.
- Hausdorff is the greatest of all these distances, in both directions.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from idem_ros.terminal.interrupts import held_back

BATCH = 200_000  # points looked up at once


class Distances(NamedTuple):
    """Of one pair at K translations of the source; each (K,), in the clouds' unit."""

    rmse_12: Any  # where it is said, another thing of each distance in its place
    rmse_21: Any
    chamfer: Any
    hausdorff: Any


# No metric changes faster per unit of translation; for Chamfer, a sum of two means: twice.
STEEPEST = Distances(1.0, 1.0, 2.0, 1.0)


class CloudDistances:
    """The distances of a target P_1 (N, 3) and a source P_2 (M, 3); trees are built once."""

    def __init__(self, target, source, threads=1):
        self.target, self.source = np.asarray(target, float), np.asarray(source, float)
        self.trees = KDTree(self.target), KDTree(self.source)
        self.threads = threads

    def at(self, translations):
        """Return `Distances` at (K, 3) translations of the source."""
        translations = np.atleast_2d(np.asarray(translations, float))
        per_batch = max(1, BATCH // (len(self.target) + len(self.source)))
        parts = [
            self._batch(translations[begin : begin + per_batch])
            for begin in range(0, len(translations), per_batch)
        ]
        return Distances(*np.concatenate(parts, axis=1))

    def _batch(self, translations):
        shifts = translations[:, None, :]
        to_target, to_source = self.trees
        # P_1 seen from the moved P_2 is P_1 moved back.
        of_target = nearest(to_source, self.target - shifts, self.threads)
        of_source = nearest(to_target, self.source + shifts, self.threads)
        return np.stack(
            [
                np.sqrt(np.mean(of_target**2, axis=1)),
                np.sqrt(np.mean(of_source**2, axis=1)),
                of_target.mean(axis=1) + of_source.mean(axis=1),
                np.maximum(of_target.max(axis=1), of_source.max(axis=1)),
            ]
        )


def nearest(tree, points, threads):
    """Return how far the nearest point of a `KDTree` is from each of some points (..., 3).

    Ctrl-C waits for its end: interrupted, scipy frees what the query's threads still write.
    """
    with held_back():
        distances, _ = tree.query(points, workers=threads)
    return distances
