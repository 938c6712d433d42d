import numpy as np
import pytest

from idem_ros.simulation.raycast import cast
from idem_ros.simulation.surfaces import Scene, box

FAR = 100.0


def nearest(distances):
    ahead = [d for d in distances if d > 1e-9]
    return min(ahead, default=np.inf)


def naive_triangle(corners, origin, ray):
    """Where a ray meets the plane, by three equations; inside if barycentric signs agree."""
    a, b, c = corners
    try:
        u, v, minus_t = np.linalg.solve(np.column_stack([b - a, c - a, -ray]), origin - a)
    except np.linalg.LinAlgError:
        return np.inf
    return minus_t if min(u, v) >= 0 and u + v <= 1 and minus_t > 1e-9 else np.inf


def naive_box(row, origin, ray):
    """Every one of the six faces, as a rectangle in the box's own frame."""
    center, half, yaw = row[:3], row[3:6], row[6]
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    start, along = turn @ (origin - center), turn @ ray
    hits = []
    for axis in range(3):
        for side in (-half[axis], half[axis]):
            if along[axis] == 0:
                continue
            t = (side - start[axis]) / along[axis]
            others = [k for k in range(3) if k != axis]
            if all(abs(start[k] + t * along[k]) <= half[k] + 1e-12 for k in others):
                hits.append(t)
    return nearest(hits)


def naive_cylinder(row, origin, ray):
    """The mantle by a quadratic, the two ends as discs."""
    x, y, low, high, radius = row
    s = origin[:2] - (x, y)
    hits = []
    a, b, c = ray[:2] @ ray[:2], 2 * s @ ray[:2], s @ s - radius**2
    if a > 0 and b * b >= 4 * a * c:
        for t in ((-b + sign * np.sqrt(b * b - 4 * a * c)) / (2 * a) for sign in (-1, 1)):
            if low <= origin[2] + t * ray[2] <= high:
                hits.append(t)
    if ray[2] != 0:
        for end in (low, high):
            t = (end - origin[2]) / ray[2]
            if np.linalg.norm(s + t * ray[:2]) <= radius:
                hits.append(t)
    return nearest(hits)


def naive_sphere(row, origin, ray):
    s = origin - row[:3]
    roots = np.roots([1.0, 2 * s @ ray, s @ s - row[3] ** 2])
    return nearest([t.real for t in roots if abs(t.imag) < 1e-12])


def naive_cast(scene, origin, rays):
    surfaces = (
        (naive_triangle, scene.triangles),
        (naive_box, scene.boxes),
        (naive_cylinder, scene.cylinders),
        (naive_sphere, scene.spheres),
    )
    found = [
        min((hit(row, origin, ray) for hit, rows in surfaces for row in rows), default=np.inf)
        for ray in rays
    ]
    return np.where(np.array(found) <= FAR, found, np.inf)


def random_scene(rng):
    sizes = rng.uniform(0.3, 2.0, (6, 3))
    boxes = np.column_stack([rng.uniform(-6, 6, (6, 3)), sizes, rng.uniform(0, 6, 6)])
    low = rng.uniform(-3, 0, 6)
    cylinders = np.column_stack(
        [rng.uniform(-6, 6, (6, 2)), low, low + rng.uniform(1, 4, 6), rng.uniform(0.2, 1.5, 6)]
    )
    spheres = np.column_stack([rng.uniform(-6, 6, (6, 3)), rng.uniform(0.3, 2.0, 6)])
    return Scene(rng.uniform(-8, 8, (10, 3, 3)), boxes, cylinders, spheres)


def rays(rng, n):
    directions = rng.normal(size=(n, 3))
    directions[:6] = np.vstack([np.eye(3), -np.eye(3)])  # along the axes: divisions by zero
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize('seed', range(6))
def test_ranges_are_those_of_the_geometry_from_outside_and_inside(seed):
    rng = np.random.default_rng(seed)
    scene, origin, directions = random_scene(rng), rng.uniform(-4, 4, 3), rays(rng, 150)
    expected = naive_cast(scene, origin, directions)
    assert np.isfinite(expected).sum() > 30
    np.testing.assert_allclose(cast(scene, origin, directions, FAR), expected, atol=1e-9)


@pytest.mark.parametrize('kind', ['triangles', 'boxes', 'cylinders', 'spheres'])
def test_each_kind_of_surface_is_hit_alone(rng, kind):
    scene = Scene(**{kind: getattr(random_scene(rng), kind)})
    origin, directions = np.array([0.1, -0.2, 0.3]), rays(rng, 200)
    expected = naive_cast(scene, origin, directions)
    assert np.isfinite(expected).any()
    np.testing.assert_allclose(cast(scene, origin, directions, FAR), expected, atol=1e-9)


def test_from_inside_a_box_is_a_room(rng):
    room = Scene(boxes=[box((-2, -3, -1), (2, 3, 1))])
    hits = cast(room, np.zeros(3), rays(rng, 100), FAR)[:, None] * rays(
        np.random.default_rng(0), 100
    )
    assert np.isclose(np.abs(hits) / (2, 3, 1), 1.0, atol=1e-9).any(axis=1).all()


def test_an_empty_scene_and_a_short_range_return_nothing(rng):
    assert np.isinf(cast(Scene(), np.zeros(3), rays(rng, 10), FAR)).all()
    sphere = Scene(spheres=[(0, 0, 0, 5.0)])
    assert np.isinf(cast(sphere, np.zeros(3), rays(rng, 10), 4.9)).all()


def test_the_ranges_do_not_depend_on_where_the_world_is(rng):
    scene, directions = random_scene(rng), rays(rng, 100)
    shift = np.array([3.0, -7.0, 2.0])
    moved = Scene(
        scene.triangles + shift,
        scene.boxes + np.r_[shift, 0, 0, 0, 0],
        scene.cylinders + np.r_[shift[:2], shift[2], shift[2], 0],
        scene.spheres + np.r_[shift, 0],
    )
    here, there = (cast(s, o, directions, FAR) for s, o in ((scene, np.zeros(3)), (moved, shift)))
    np.testing.assert_allclose(here, there, atol=1e-9)
