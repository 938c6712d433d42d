"""q_tot of one pair of clouds at many transforms: prepared once, every pair visited once."""

from typing import NamedTuple

import numpy as np

from idem_ros.core import se3
from idem_ros.core.blocks import in_threads
from idem_ros.core.cloud import as_cloud, neighbourhoods
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidTransform
from idem_ros.core.grid import neighbours, room_for
from idem_ros.core.jit import kernel
from idem_ros.core.joint_entropy import length_unit
from idem_ros.core.metric import checked_positive, search_radius
from idem_ros.core.moments import TIE, entropy, into_frame, plus, rotated, row_of

SPAN = 16  # transforms that a thread takes at a time
ROUNDED = 1e-12  # how far a rotation may be off before it is made orthonormal


class Values(NamedTuple):
    """What `Landscape.values` found at each of K transforms."""

    q_tot: np.ndarray  # (K,) float64 [nat]
    within: np.ndarray  # (K,) int64: points of both clouds with a neighbour in the other


class Landscape:
    """q_tot (Eq. 8) of one pair as a function of the transform between them.

    The same numbers as `q_tot`, to rounding, in less than half its time for each of many: the
    clouds' own entropies are computed once, and each pair across the clouds is visited once for
    both of its points. Whatever the number of threads, each transform is summed by one of them:
    the results are the same, to the bit.

    Args:
        target: (N, 3) points or a `Cloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        radius: of the neighbourhoods, in the clouds' unit; None: Eq. 9 with a = 1.
        length_scale: 'radius' or 'none', as for `q_tot`.
        threads: that share the transforms of one call.

    Raises:
        InvalidCloud, InvalidConfig: for what cannot be evaluated.
    """

    def __init__(self, target, source, radius=None, length_scale='radius', threads=1):
        RegistrationConfig(length_scale=length_scale, threads=threads)  # refuses what is neither
        self.target, self.source, self.threads = as_cloud(target), as_cloud(source), threads
        if radius is None:
            self.radius = search_radius(self.target, self.source)
        else:
            self.radius = checked_positive('radius', radius)
        self._scale = length_unit(length_scale, self.radius)
        # The smaller cloud asks for neighbours, the larger one is asked.
        self._swapped = len(self.source) < len(self.target)
        if self.radius > 0.0:
            pair = (self.source, self.target) if self._swapped else (self.target, self.source)
            self._centres, self._others = neighbourhoods(pair, self.radius, self._scale, threads)

    def at(self, transforms):
        """Return q_tot, (K,) [nat], at T_target_source of (K, 4, 4).

        Raises:
            InvalidTransform: another shape, or one that is not a rigid motion, by its number.
        """
        return self.values(transforms).q_tot

    def values(self, transforms):
        """Return `Values`: q_tot and the points with a neighbour across, as for `at`."""
        rotations, translations = self._between_origins(_checked(transforms))
        q, within = np.zeros(len(rotations)), np.zeros(len(rotations), np.int64)
        if self.radius == 0.0:  # all points in one place: every entropy is 0
            return Values(q, within)
        spans = [slice(begin, begin + SPAN) for begin in range(0, len(q), SPAN)]

        def fill(span):
            """Evaluate a block of the poses."""
            pair = (self._centres, self._others)
            size = (self.radius**2 * TIE, self._scale)
            _evaluate(
                *map(_fixed, pair),
                rotations[span],
                translations[span],
                *size,
                q[span],
                within[span],
            )

        in_threads(self.threads, fill, spans)
        return Values(q, within)

    def _between_origins(self, transforms):
        """Return (K, 3, 3) and (K, 3): the motion of the others between the clouds' origins."""
        R, t = transforms[:, :3, :3], transforms[:, :3, 3]
        t = t + R @ self.source.origin - self.target.origin
        if self._swapped:
            R = R.transpose(0, 2, 1)
            t = -np.einsum('kij,kj->ki', R, t)
        return np.ascontiguousarray(R), np.ascontiguousarray(t)


class _Fixed(NamedTuple):
    """The part of a cloud's neighbourhoods that no transform changes."""

    grid: tuple
    own: np.ndarray  # (N, 10)
    entropy: np.ndarray  # (N,)


def _fixed(own):
    return _Fixed(own.grid, own.unit_own, own.entropy)


def _checked(transforms):
    """Return (K, 4, 4) float64; only those that are not rigid to the last digits cost time."""
    try:
        T = np.array(transforms, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidTransform(f'transforms are not matrices of numbers: {error}') from error
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise InvalidTransform(f'transforms have shape {T.shape}; they must be (K, 4, 4)')
    R = T[:, :3, :3]
    with np.errstate(invalid='ignore', over='ignore'):
        error = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        rigid = (error <= ROUNDED) & (np.linalg.det(R) > 0) & (T[:, 3] == (0, 0, 0, 1)).all(1)
    rigid &= np.isfinite(T).all(axis=(1, 2))
    for k in np.flatnonzero(~rigid):
        T[k] = se3.checked_transform(T[k], f'transforms[{k}]')
    return T


@kernel
def _evaluate(centres, others, rotations, translations, r2, scale, q, within):
    """Fill q_tot (Eq. 8) and the number of points with a neighbour across, per transform."""
    others_m = np.zeros((others.own.shape[0], 10))
    room = room_for(others.grid)
    for k in range(rotations.shape[0]):
        R, t = rotations[k], translations[k]
        others_m[:] = 0.0
        total, count = _of_centres(centres, others.grid, R, t, r2, scale, room, others_m)
        total_of_others, count_of_others = _of_others(others, others_m, scale)
        q[k] = total + total_of_others
        within[k] = count + count_of_others


@kernel
def _of_centres(centres, grid, R, t, r2, scale, room, others_m):
    """Sum q_i of the centres, and add each pair's moments to those of its other point, too."""
    found, rows = room
    total, count = 0.0, 0
    for i in range(centres.own.shape[0]):
        x, y, z = into_frame(centres.grid.points[i], R, t)
        n = neighbours(x, y, z, grid, r2, found, rows)
        if n == 0:
            continue
        m = _shared_moments(x, y, z, grid.points, found, n, others_m)
        total += entropy(plus(row_of(centres.own, i), rotated(R, m)), scale) - centres.entropy[i]
        count += 1
    return total, count


@kernel
def _of_others(others, others_m, scale):
    """Sum q_i of the others, whose moments across are known."""
    total, count = 0.0, 0
    for j in range(others.own.shape[0]):
        if others_m[j, 0] > 0.0:
            joint = plus(row_of(others.own, j), row_of(others_m, j))
            total += entropy(joint, scale) - others.entropy[j]
            count += 1
    return total, count


@kernel
def _shared_moments(x, y, z, points, found, n, others_m):
    """Sum 1, d and d d^T about a centre; add the same, with -d, to each neighbour's own row."""
    k = sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for c in range(np.uint64(n)):
        j = np.uint64(found[c])
        dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
        pxx, pxy, pxz, pyy, pyz, pzz = dx * dx, dx * dy, dx * dz, dy * dy, dy * dz, dz * dz
        row = others_m[j]
        row[0] += 1.0
        row[1] -= dx
        row[2] -= dy
        row[3] -= dz
        row[4] += pxx
        row[5] += pxy
        row[6] += pxz
        row[7] += pyy
        row[8] += pyz
        row[9] += pzz
        k += 1.0
        sx += dx
        sy += dy
        sz += dz
        xx += pxx
        xy += pxy
        xz += pxz
        yy += pyy
        yz += pyz
        zz += pzz
    return (k, sx, sy, sz, xx, xy, xz, yy, yz, zz)
