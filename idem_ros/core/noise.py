"""How much of a ball is noise: the thickness of surfaces, and the wider ball it asks for."""

import numpy as np

QUARTILE = 0.25  # the flattest balls hold noise alone; the others edges, curvature, leaves
LEAST_MEMBERS = 5  # three of k fix a plane: what is left of k / (k - 3) tells its noise
# Members along a line, as one ring of a LiDAR leaves them, lie on the ring's cone: no noise shows.
LEAST_SPREAD = 0.08  # of the second axis against the first, about
SAMPLE = 1024  # balls of each cloud, about
ENOUGH = 250.0  # r sqrt(k) over the thickness: from here on a wider ball gained nothing
WIDEST = 2.0


def widening(target, source, radius):
    """Return by how much to widen balls of a radius, 1 to 2, for the noise of two `Cloud`s.

    The means of k points of a surface of thickness s are known to s / sqrt(k); where the ball is
    not wide against that, it tells the surface's direction badly. Measured, not derived: twice the
    radius halves the error in a room at 9 standard deviations of noise, and doubles it in a
    street at 50.
    """
    found = [cloud.thickness(radius) for cloud in (target, source)]
    thickness = max(s for s, _ in found)
    members = sum(k for _, k in found)
    wanted = np.sqrt(ENOUGH * thickness / (radius * np.sqrt(members))) if members else 1.0
    return float(np.clip(wanted, 1.0, WIDEST))


def thickness_and_members(own):
    """Return the lower quartile of balls' thickness, and the median of their members.

    own: (N, 10) moments of the balls.
    """
    own = own[own[:, 0] >= LEAST_MEMBERS]
    k, (xx, xy, xz, yy, yz, zz) = own[:, 0], _covariances(own).T
    minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz)
    sheet = minors > LEAST_SPREAD * (xx + yy + zz) ** 2
    if not sheet.any():
        return 0.0, 0.0
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)
    # det / (sum of principal minors) is the least eigenvalue where it is much the least.
    least = np.maximum(det[sheet], 0.0) / minors[sheet] * k[sheet] / (k[sheet] - 3)
    return float(np.quantile(np.sqrt(least), QUARTILE)), float(np.median(k))


def _covariances(moments):
    mean = moments[:, 1:4] / moments[:, :1]
    outer = mean[:, [0, 0, 0, 1, 1, 2]] * mean[:, [0, 1, 2, 1, 2, 2]]
    return moments[:, 4:] / moments[:, :1] - outer
