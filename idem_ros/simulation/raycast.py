"""Ray casting: the distance along each ray to the nearest surface of a scene."""

import numpy as np

from idem_ros.core.jit import compiler

# No fastmath and no parallel sums: the same scene and rays give the same bits everywhere.
kernel = compiler(nogil=True)
NEAREST = 1e-9  # [m]: a ray that starts on a surface does not hit it
SECTORS = 128  # of the azimuth: a ray looks at the surfaces in its own only


def cast(scene, origin, directions, max_range):
    """Return the exact range of every ray.

    Args:
        scene: Scene.
        origin: (3,) where all rays start, or (n, 3) where each does, in the scene's frame [m].
        directions: (n, 3) unit vectors in the scene's frame.
        max_range: farthest hit [m].

    Returns:
        (n,) ranges [m]; infinity where nothing is hit within `max_range`.
    """
    boxes = np.column_stack([scene.boxes, np.cos(scene.boxes[:, 6]), np.sin(scene.boxes[:, 6])])
    rays = np.ascontiguousarray(directions, dtype=np.float64)
    origins = np.atleast_2d(np.ascontiguousarray(origin, dtype=np.float64))
    middle = origins[len(origins) // 2]
    bounds = bounding_spheres(scene)
    bounds[:, :3] -= middle
    # What a ray meets is as far from where one from the middle would be as their origins are.
    apart = np.linalg.norm(origins - middle, axis=1).max()
    return _cast(
        origins,
        origins - middle,
        rays,
        _sector(np.arctan2(rays[:, 1], rays[:, 0])) % SECTORS,
        float(max_range),
        _by_sector(bounds + (0.0, 0.0, 0.0, apart), max_range),
        bounds,
        (scene.triangles, boxes, scene.cylinders, scene.spheres),
    )


def bounding_spheres(scene):
    """Return (n, 4) centre and radius around triangles, boxes, cylinders, spheres, in order."""
    centers = scene.triangles.mean(axis=1)
    reach = np.linalg.norm(scene.triangles - centers[:, None], axis=2).max(axis=1, initial=0.0)
    x, y, low, high, radius = scene.cylinders.T
    return np.concatenate(
        [
            np.column_stack([centers, reach]),
            np.column_stack([scene.boxes[:, :3], np.linalg.norm(scene.boxes[:, 3:6], axis=1)]),
            np.column_stack([x, y, (low + high) / 2, np.hypot(radius, (high - low) / 2)]),
            scene.spheres,
        ]
    ) + np.array([0.0, 0.0, 0.0, 1e-6])


def _by_sector(bounds, max_range):
    """Return the surfaces of each sector, the nearest first.

    Returns:
        (SECTORS + 1,) where each sector begins in what follows, the numbers of its surfaces, and
        how near each of them may be.
    """
    x, y, z, radius = bounds.T
    least = np.sqrt(x * x + y * y + z * z) - radius
    near = np.flatnonzero(least <= max_range)
    near = near[np.argsort(least[near], kind='stable')]
    x, y, radius = x[near], y[near], radius[near]
    away, azimuth = np.hypot(x, y), np.arctan2(y, x)
    is_around = away <= 1.001 * radius
    half = np.arcsin(np.where(is_around, 0.0, radius / np.where(is_around, 1.0, away))) + 1e-6
    first = np.where(is_around, 0, _sector(azimuth - half))
    last = np.where(is_around, SECTORS - 1, _sector(azimuth + half))
    count = np.minimum(last - first + 1, SECTORS)
    which = np.repeat(np.arange(len(near)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    sector = (first[which] + step) % SECTORS
    order = np.argsort(sector, kind='stable')
    start = np.concatenate([[0], np.cumsum(np.bincount(sector, minlength=SECTORS))])
    surfaces = near[which[order]]
    return start, surfaces, least[surfaces]


def _sector(azimuth):
    return np.floor(azimuth * (SECTORS / (2 * np.pi))).astype(np.int64)


@kernel
def _cast(origins, off, rays, sector, max_range, by_sector, bounds, surfaces):
    each = np.int64(len(origins) > 1)
    start, nearest_first, least = by_sector
    triangles, boxes, cylinders, spheres = surfaces
    first_box = len(triangles)
    first_cylinder = first_box + len(boxes)
    first_sphere = first_cylinder + len(cylinders)
    ranges = np.empty(len(rays))
    for i in range(len(rays)):
        ray = (rays[i, 0], rays[i, 1], rays[i, 2])
        at_own = i * each
        origin = (origins[at_own, 0], origins[at_own, 1], origins[at_own, 2])
        moved = (off[at_own, 0], off[at_own, 1], off[at_own, 2])
        nearest = np.inf
        limit = max_range
        for at in range(start[sector[i]], start[sector[i] + 1]):
            k = nearest_first[at]
            if least[at] > limit:
                break
            if _misses(bounds, k, moved, ray, limit):
                continue
            if k < first_box:
                distance = _to_triangle(triangles, k, origin, ray)
            elif k < first_cylinder:
                distance = _to_box(boxes, k - first_box, origin, ray)
            elif k < first_sphere:
                distance = _to_cylinder(cylinders, k - first_cylinder, origin, ray)
            else:
                distance = _to_sphere(spheres, k - first_sphere, origin, ray)
            if distance <= limit:
                nearest = distance
                limit = distance
        ranges[i] = nearest
    return ranges


@kernel
def _misses(bounds, k, moved, ray, limit):
    """Whether the ray passes a bounding sphere by, or meets it only beyond `limit` or behind."""
    x, y, z = bounds[k, 0] - moved[0], bounds[k, 1] - moved[1], bounds[k, 2] - moved[2]
    radius = bounds[k, 3]
    along = x * ray[0] + y * ray[1] + z * ray[2]
    if along < -radius or along - radius > limit:
        return True
    return x * x + y * y + z * z - along * along > radius * radius


@kernel
def _to_triangle(triangles, k, origin, ray):
    """Möller and Trumbore: hit = corner + a u + b v with a, b >= 0 and a + b <= 1."""
    cx, cy, cz = triangles[k, 0, 0], triangles[k, 0, 1], triangles[k, 0, 2]
    ux, uy, uz = triangles[k, 1, 0] - cx, triangles[k, 1, 1] - cy, triangles[k, 1, 2] - cz
    vx, vy, vz = triangles[k, 2, 0] - cx, triangles[k, 2, 1] - cy, triangles[k, 2, 2] - cz
    px, py, pz = ray[1] * vz - ray[2] * vy, ray[2] * vx - ray[0] * vz, ray[0] * vy - ray[1] * vx
    det = ux * px + uy * py + uz * pz
    if abs(det) < 1e-14:
        return np.inf
    sx, sy, sz = origin[0] - cx, origin[1] - cy, origin[2] - cz
    a = (sx * px + sy * py + sz * pz) / det
    if a < 0.0 or a > 1.0:
        return np.inf
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    b = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / det
    if b < 0.0 or a + b > 1.0:
        return np.inf
    distance = (vx * qx + vy * qy + vz * qz) / det
    return distance if distance > NEAREST else np.inf


@kernel
def _to_box(boxes, k, origin, ray):
    """Slabs, in the box's own frame."""
    sx, sy, sz = origin[0] - boxes[k, 0], origin[1] - boxes[k, 1], origin[2] - boxes[k, 2]
    cos, sin = boxes[k, 7], boxes[k, 8]
    start = (cos * sx + sin * sy, cos * sy - sin * sx, sz)
    along = (cos * ray[0] + sin * ray[1], cos * ray[1] - sin * ray[0], ray[2])
    enter, leave = -np.inf, np.inf
    for axis in range(3):
        half = boxes[k, 3 + axis]
        if along[axis] == 0.0:
            if abs(start[axis]) > half:
                return np.inf
            continue
        one, other = (-half - start[axis]) / along[axis], (half - start[axis]) / along[axis]
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    if enter > leave:
        return np.inf
    return _first_ahead(enter, leave)


@kernel
def _to_cylinder(cylinders, k, origin, ray):
    """The overlap of two intervals: inside the infinite cylinder, and between the two ends."""
    sx, sy = origin[0] - cylinders[k, 0], origin[1] - cylinders[k, 1]
    low, high = cylinders[k, 2] - origin[2], cylinders[k, 3] - origin[2]
    radius = cylinders[k, 4]
    enter, leave = -np.inf, np.inf
    flat = ray[0] * ray[0] + ray[1] * ray[1]
    outside = sx * sx + sy * sy - radius * radius
    if flat > 0.0:
        half = sx * ray[0] + sy * ray[1]
        root = half * half - flat * outside
        if root < 0.0:
            return np.inf
        enter, leave = (-half - np.sqrt(root)) / flat, (-half + np.sqrt(root)) / flat
    elif outside > 0.0:
        return np.inf
    if ray[2] != 0.0:
        one, other = low / ray[2], high / ray[2]
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    elif low > 0.0 or high < 0.0:
        return np.inf
    if enter > leave:
        return np.inf
    return _first_ahead(enter, leave)


@kernel
def _to_sphere(spheres, k, origin, ray):
    sx, sy, sz = origin[0] - spheres[k, 0], origin[1] - spheres[k, 1], origin[2] - spheres[k, 2]
    half = sx * ray[0] + sy * ray[1] + sz * ray[2]
    root = half * half - (sx * sx + sy * sy + sz * sz - spheres[k, 3] * spheres[k, 3])
    if root < 0.0:
        return np.inf
    return _first_ahead(-half - np.sqrt(root), -half + np.sqrt(root))


@kernel
def _first_ahead(enter, leave):
    if enter > NEAREST:
        return enter
    return leave if leave > NEAREST else np.inf
