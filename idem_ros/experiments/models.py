"""The object of the paper's experiments, B_0, or what stands in for it; another sampling of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from idem_ros.core import fourth_neighbor_distance
from idem_ros.core.exceptions import IdemError
from idem_ros.files.cloud_file import read_cloud
from idem_ros.simulation.body import BUNNY, SIZE, remeshed_points

POINTS = 1597  # of the paper's B_0
R_4TH = 3.13  # [mm], of the paper's B_0
ASKED = 2250  # of the own surface's even sampling, which gives about 1 880: the bunny has 1 889
SEARCH_STEPS = 14  # halvings of the bracket of edge lengths
SAMPLES = 100  # dense samples per point that is kept, where there is no pymeshlab
NEIGHBOURS = 6


class UnusableModel(IdemError):
    """A model that the experiments cannot start from."""


@dataclass(frozen=True, eq=False)
class Model:
    """B_0 and the surface that it was taken from, in one frame.

    Attributes:
        name: one word for tables and titles.
        points: (1597, 3) B_0 [mm].
        note: a sentence for each page that says what stands in for the paper's B_0.
        vertices: (V, 3) of the mesh that the points were chosen from [mm].
        faces: (F, 3) indices of vertices; F = 0 where the file holds no faces.
    """

    name: str
    points: np.ndarray
    note: str
    vertices: np.ndarray
    faces: np.ndarray


def paper_model(path=None, seed=0):
    """Return the `Model` in place of the paper's B_0, which is not public.

    Vertices are thinned to 1597 by a seeded choice and scaled until r_4th is 3.13 mm.

    Args:
        path: a mesh or cloud, bun_zipper_res3.ply for the paper's object; None: a closed,
            bunny-like surface by one formula (`idem_ros.simulation.body`).
        seed: of the choice, and of the surface's sampling.

    Raises:
        UnreadableCloud: the file holds no points.
        UnusableModel: it holds fewer than 1597, or r_4th = 0.
    """
    rng = np.random.default_rng([seed, POINTS])
    vertices, faces, name, origin = _own_surface(rng) if path is None else _read_model(path)
    chosen = np.sort(rng.choice(len(vertices), POINTS, replace=False))
    spacing = fourth_neighbor_distance(vertices[chosen])
    if not spacing > 0:
        raise UnusableModel(f'{path} has its points on top of one another: r_4th is {spacing}')
    vertices = (vertices - vertices.mean(axis=0)) * (R_4TH / spacing)
    note = (
        f"The paper's B_0 (1597 points, r_4th = 3.13 mm) is not public. Here it is {origin}: "
        f'{len(vertices)} vertices thinned to {POINTS} by a choice with seed {seed}, '
        f'scaled to r_4th = {R_4TH} mm.'
    )
    return Model(name, vertices[chosen], note, vertices, faces)


def _own_surface(rng):
    """Even points of the formula's surface; their directions' hull are its triangles."""
    points = remeshed_points(rng, ASKED)
    direction = points / (SIZE * np.array(BUNNY.stretch))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    faces = _outward(direction, ConvexHull(direction).simplices)
    # The bunny stands: y is up in its file, z in the formula.
    upright = points[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    return upright, faces, 'own', "a closed, bunny-like surface of the project's own making"


def _outward(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum('ij,ij->i', np.cross(b - a, c - a), a) < 0
    faces = faces.copy()
    faces[inward] = faces[inward][:, ::-1]
    return faces


def _read_model(path):
    path = Path(path)
    vertices = read_cloud(path)
    if len(vertices) < POINTS:
        raise UnusableModel(
            f'{path} has {len(vertices)} usable vertices; the experiments need {POINTS} or more'
        )
    return vertices, _read_faces(path, len(vertices)), path.stem, f'the model {path.name}'


def _read_faces(path, count):
    """Return the triangles of a PLY; none where vertices were left out or have no faces."""
    none = np.empty((0, 3), dtype=np.int64)
    if path.suffix.lower() != '.ply':
        return none
    from plyfile import PlyData

    ply = PlyData.read(path)
    if 'face' not in ply or len(ply['vertex']) != count or len(ply['face']) == 0:
        return none
    corners = ply['face'].data[ply['face'].properties[0].name]
    triangles = [face for face in corners if len(face) == 3]
    return np.array(triangles, dtype=np.int64) if triangles else none


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
