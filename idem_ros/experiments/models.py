"""The object of the paper's experiments, B_0, or what stands in for it."""

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
