import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import InvalidConfig, InvalidTransform, q_tot
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import (
    Landscape,
    centroid,
    displaced,
    offsets_on_grid,
    q_on_grid,
)


def test_a_displacement_follows_the_pose(rng):
    T, pivot = motion(rng, 40, 2.0), rng.normal(size=3)
    shifted, turned = displaced(T, [(1, 2, 3, 0, 0, 0), (0, 0, 0, 0, 0, np.pi / 2)], pivot)
    np.testing.assert_allclose(shifted[:3, 3] - T[:3, 3], (1, 2, 3))
    p = rng.normal(size=3)
    around = se3.transform_points(T, p) - pivot
    quarter = (-around[1], around[0], around[2])
    np.testing.assert_allclose(se3.transform_points(turned, p) - pivot, quarter)


def test_rotations_leave_the_pivot_alone(rng):
    T, pivot = motion(rng, 40, 2.0), rng.normal(size=3)
    (turned,) = displaced(T, [(0, 0, 0, 0.3, -0.2, 1.0)], pivot)
    at_pivot = se3.transform_points(se3.inverse(T), pivot)
    np.testing.assert_allclose(se3.transform_points(turned, at_pivot), pivot)


def test_the_source_turns_around_x_before_y(rng):
    offset = [(0, 0, 0, np.pi / 2, np.pi / 2, 0)]
    (turned,) = displaced(np.eye(4), offset, np.zeros(3))
    np.testing.assert_allclose(turned[:3, :3] @ (0, 1, 0), (1, 0, 0), atol=1e-12)


def test_a_grid_has_its_first_axis_slowest():
    shape, offsets = offsets_on_grid(y=[1, 2], rz=[3, 4, 5])
    assert shape == (2, 3)
    np.testing.assert_array_equal(offsets[:, 1], [1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(offsets[:, 5], [3, 4, 5, 3, 4, 5])
    assert not offsets[:, [0, 2, 3, 4]].any()


def test_the_centroid_is_that_of_the_moved_source(rng):
    target, source, T = surface(rng, 50), surface(rng, 50) + 5, motion(rng, 40, 2.0)
    expected = se3.transform_points(T, source).mean(axis=0)
    np.testing.assert_allclose(centroid(Landscape(target, source), T), expected)


def test_q_on_a_grid_is_q_tot_of_each_displacement(rng):
    target, source, T = surface(rng, 200), surface(rng, 150), motion(rng, 5, 0.05)
    landscape = Landscape(target, source)
    q = q_on_grid(landscape, T, x=[-0.1, 0, 0.1], z=[0, 0.2])
    moved = T.copy()
    moved[:3, 3] += (0.1, 0, 0.2)
    assert q.shape == (3, 2)
    assert q[1, 0] == pytest.approx(q_tot(target, source, T))
    assert q[2, 1] == pytest.approx(q_tot(target, source, moved))


def test_misuse_is_refused(rng):
    landscape = Landscape(surface(rng, 20), surface(rng, 20))
    with pytest.raises(InvalidConfig, match="given: \\['w'\\]"):
        q_on_grid(landscape, w=[0.0])
    with pytest.raises(InvalidConfig, match='given: none'):
        q_on_grid(landscape)
    with pytest.raises(InvalidTransform, match='shape'):
        q_on_grid(landscape, np.eye(3), x=[0.0])
