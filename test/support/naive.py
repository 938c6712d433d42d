"""Slow twins, written from the equations with plain loops; they share no code with core."""

import math

import numpy as np


def ball(points, centre, radius):
    return points[np.linalg.norm(points - centre, axis=1) <= radius]


def entropy(members, scale=1.0):
    """Eq. 4, in three dimensions, Sigma divided by k."""
    if len(members) <= 3:
        return 0.0
    deviations = (members - members.mean(axis=0)) / scale
    sigma = deviations.T @ deviations / len(members)
    return 0.5 * math.log1p((2 * math.pi * math.e) ** 3 * max(np.linalg.det(sigma), 0.0))


def q_per_point(target, source_in_target, radius, scale):
    """Eq. 7, for the points of the target and then of the source."""
    joint = np.vstack([target, source_in_target])
    own = [target] * len(target) + [source_in_target] * len(source_in_target)
    return np.array(
        [
            entropy(ball(joint, p, radius), scale) - entropy(ball(cloud, p, radius), scale)
            for p, cloud in zip(joint, own, strict=True)
        ]
    )


def fourth_neighbor_distance(points):
    return np.mean([np.sort(np.linalg.norm(points - p, axis=1))[4] for p in points])


def search_radius(target, source, a):
    n_t, n_s = len(target), len(source)
    r_t, r_s = fourth_neighbor_distance(target), fourth_neighbor_distance(source)
    return a * (r_t * n_s / (n_t + n_s) + r_s * n_t / (n_t + n_s))


def moments(points, weight, scatter, centre, radius):
    """Sums of weight, d and d d^T (+ scatter) over a ball, one point at a time."""
    k, s, outer = 0.0, np.zeros(3), np.zeros((3, 3))
    for p, w, c in zip(points, weight, scatter, strict=True):
        d = p - centre
        if np.linalg.norm(d) <= radius:
            k, s, outer = k + w, s + w * d, outer + w * np.outer(d, d) + symmetric(c)
    return k, s, outer


def symmetric(upper):
    xx, xy, xz, yy, yz, zz = upper
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def voxels(points, size):
    """Mean, count and scatter of each occupied voxel, by the voxel's indices."""
    cells = np.floor((points - points.min(axis=0)) / size).astype(int)
    found = {}
    for cell in {tuple(c) for c in cells}:
        members = points[(cells == cell).all(axis=1)]
        deviations = members - members.mean(axis=0)
        found[cell] = (members.mean(axis=0), len(members), deviations.T @ deviations)
    return found


def held_q(centres, fixed, moving, scale, noise=0.0):
    """Sum of joint entropies with the members of each ball held: lists of arrays, one a centre."""
    total = 0.0
    for i in range(len(centres)):
        members = np.vstack([fixed[i], moving[i]])
        if len(moving[i]) == 0 or len(members) <= 3:
            continue
        deviations = members - members.mean(axis=0)
        sigma = deviations.T @ deviations / len(members) + noise * np.eye(3)
        total += 0.5 * math.log1p((2 * math.pi * math.e) ** 3 * np.linalg.det(sigma) / scale**6)
    return total


def entropy_of_moments(positions, counts, within, scale, noise):
    """Eq. 4 of raw points known by their means' positions, counts and summed scatter."""
    mean = counts @ positions / counts.sum()
    deviations = positions - mean
    sigma = (deviations.T @ (counts[:, None] * deviations) + within) / counts.sum()
    det = np.linalg.det(sigma + noise * np.eye(3)) / scale**6
    return 0.5 * math.log1p((2 * math.pi * math.e) ** 3 * det)


def hold(target, source, radius, units):
    """How firmly surfaces hold motions: eigenvalues of the mean of j_A j_B^T; how many balls."""
    products = []
    for centre in np.concatenate([target, source]):
        sides = [plane_of(ball(cloud, centre, radius)) for cloud in (target, source)]
        if None in sides:
            continue
        (xa, na), (xb, nb) = sides
        nb = nb if na @ nb >= 0 else -nb
        ja, jb = (np.r_[np.cross(x, n), n] @ units for x, n in ((xa, na), (xb, nb)))
        products.append(np.outer(ja, jb))
    mean = np.mean(products, axis=0)
    return np.linalg.eigvalsh((mean + mean.T) / 2), len(products)


def plane_of(members):
    """Mean and normal of a flat ball's members; None where they are few, a line or not flat."""
    if len(members) < 5:
        return None
    covariance = np.cov(members.T, bias=True)
    spread, axes = np.linalg.eigh(covariance)
    minors = spread[0] * spread[1] + spread[0] * spread[2] + spread[1] * spread[2]
    if minors <= 0.08 * spread.sum() ** 2 or 4.0 * np.prod(spread) * spread.sum() >= minors**2:
        return None
    return members.mean(axis=0), axes[:, 0]


def distances(target, source):
    """RMSE both ways, Chamfer and Hausdorff of two clouds."""
    of_target = [min(np.linalg.norm(p - q) for q in source) for p in target]
    of_source = [min(np.linalg.norm(p - q) for q in target) for p in source]
    rmse = [math.sqrt(sum(d * d for d in each) / len(each)) for each in (of_target, of_source)]
    chamfer = sum(of_target) / len(of_target) + sum(of_source) / len(of_source)
    return *rmse, chamfer, max(*of_target, *of_source)


def undistort(points, times, twist, reference):
    """exp((t - reference) twist) p of each point, by the series of the matrix exponential."""
    (x, y, z), (a, b, c) = twist[:3], twist[3:]
    generator = np.array([[0, -c, b, x], [c, 0, -a, y], [-b, a, 0, z], [0, 0, 0, 0]], float)
    undone = []
    for p, t in zip(points, times, strict=True):
        motion, term = np.eye(4), np.eye(4)
        for k in range(1, 60):
            term = term @ generator * (t - reference) / k
            motion = motion + term
        undone.append(motion[:3, :3] @ p + motion[:3, 3])
    return np.array(undone)


def joint_q_tot(clouds, radius, scale):
    """Eq. 8 over the union of several clouds, all in one frame."""
    union = np.vstack(clouds)
    return sum(
        entropy(ball(union, p, radius), scale) - entropy(ball(cloud, p, radius), scale)
        for cloud in clouds
        for p in cloud
    )


def members_of_joint_balls(clouds, radius):
    """(cloud, number, [indices in each cloud]) of each point that meets another cloud."""
    found = []
    for c, cloud in enumerate(clouds):
        for i, p in enumerate(cloud):
            members = [np.flatnonzero(np.linalg.norm(o - p, axis=1) <= radius) for o in clouds]
            if sum(map(len, members)) > len(members[c]):
                found.append((c, i, members))
    return found


def held_joint_q(clouds, balls, scale, noise):
    """Sum of joint entropies of balls whose members are held: `members_of_joint_balls`."""
    total = 0.0
    for _, _, members in balls:
        points = np.vstack([cloud[some] for cloud, some in zip(clouds, members, strict=True)])
        if len(points) > 3:
            deviations = points - points.mean(axis=0)
            sigma = deviations.T @ deviations / len(points) + noise * np.eye(3)
            det = np.linalg.det(sigma) / scale**6
            total += 0.5 * math.log1p((2 * math.pi * math.e) ** 3 * det)
    return total
