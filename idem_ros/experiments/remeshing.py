"""Another sampling of a model's surface, for the paper's remeshed clouds."""

import numpy as np

SEARCH_STEPS = 14  # halvings of the bracket of edge lengths
SAMPLES = 100  # dense samples per point that is kept, where there is no pymeshlab
NEIGHBOURS = 6


def remeshed(model, count, rng):
    """Return (count, 3) points of the model's surface on another mesh [mm], and how they came.

    Isotropic explicit remeshing as in MeshLab, the paper's filter, at the longest edge that
    leaves `count` vertices; of the few too many some are left out by chance. Without pymeshlab,
    the model's own vertices, thinned evenly and moved along the surface as that filter does it,
    without its new edges; without triangles, farthest points among the midpoints between
    neighbouring vertices.
    """
    if len(model.faces) and (pymeshlab := _pymeshlab()):
        points = _isotropic(pymeshlab, model, count)
        how = 'isotropic explicit remeshing (pymeshlab)'
        return points[np.sort(rng.choice(len(points), count, replace=False))], how
    if len(model.faces):
        samples = surface_samples(model, SAMPLES * count, rng)
        has_enough = len(model.vertices) >= count
        candidates = model.vertices if has_enough else np.vstack([model.vertices, samples])
        return (
            relaxed(farthest_points(candidates, count, rng), samples),
            'vertices thinned evenly and relaxed along the triangles, for want of pymeshlab',
        )
    return (
        farthest_points(midpoints(model.vertices), count, rng),
        'farthest points of the midpoints between neighbours: the model has no triangles',
    )


def farthest_points(points, count, rng):
    """Return `count` of the points, each the farthest from those before it."""
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = rng.integers(len(points))
    apart = np.full(len(points), np.inf)
    for k in range(1, count):
        away = np.sum((points - points[chosen[k - 1]]) ** 2, axis=1)
        np.minimum(apart, away, out=apart)
        chosen[k] = np.argmax(apart)
    return points[chosen]


def relaxed(points, samples):
    """Return points moved to the middles of their shares of a surface, once, (N, 3).

    Args:
        points: (N, 3) on the surface.
        samples: (M, 3) of it, dense; the middles are taken to the nearest of them.
    """
    from scipy.spatial import KDTree

    _, owner = KDTree(points).query(samples)
    counts = np.maximum(np.bincount(owner, minlength=len(points)), 1)
    sums = [np.bincount(owner, axis, len(points)) for axis in samples.T]
    _, nearest = KDTree(samples).query(np.transpose(sums) / counts[:, None])
    return samples[nearest]


def _pymeshlab():
    try:
        import pymeshlab  # pyright: ignore[reportMissingImports]  # where it is installed
    except ImportError:  # also where the system lacks a library that it needs
        return None
    return pymeshlab


def _isotropic(pymeshlab, model, count):
    """Bisect the edge length; keep the sparsest mesh that has enough vertices."""
    triangles = model.vertices[model.faces]
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    ).sum()
    even = np.sqrt(area / (np.sqrt(3.0) * count))  # edge of equilateral triangles
    low, high, best = 0.5 * even, 2.0 * even, None
    for _ in range(SEARCH_STEPS):
        length = 0.5 * (low + high)
        points = _remesh_at(pymeshlab, model, length)
        if len(points) >= count:
            low = length
            best = points if best is None or len(points) < len(best) else best
        else:
            high = length
        if best is not None and len(best) == count:
            break
    assert best is not None, 'edges half as long as even ones give more'
    return best


def _remesh_at(pymeshlab, model, length):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(model.vertices, model.faces.astype(np.int32)))
    meshes.meshing_isotropic_explicit_remeshing(targetlen=pymeshlab.PureValue(length))
    return meshes.current_mesh().vertex_matrix()


def surface_samples(model, count, rng):
    """Return (count, 3) points of the model's triangles, evenly likely per area."""
    a, b, c = (model.vertices[model.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = rng.choice(len(area), count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return a[face] + u * (b - a)[face] + v * (c - a)[face]


def midpoints(vertices):
    """Return (K, 3) midpoints between neighbouring vertices, none twice."""
    from scipy.spatial import KDTree

    near: np.ndarray
    _, near = KDTree(vertices).query(vertices, NEIGHBOURS + 1)
    middle = 0.5 * (vertices[:, None] + vertices[near[:, 1:]]).reshape(-1, 3)
    return np.unique(middle, axis=0)
