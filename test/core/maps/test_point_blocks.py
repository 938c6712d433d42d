import numpy as np
import pytest

from idem_ros.core import InvalidCloud
from idem_ros.core.maps.point_blocks import PointBlocks


@pytest.fixture(scope='module')
def points():
    rng = np.random.default_rng(0)
    spread = rng.normal(size=(3000, 3)) * (20.0, 30.0, 2.0)
    lattice = np.stack(np.meshgrid(*[np.arange(-3.0, 4.0)] * 3), -1).reshape(-1, 3)
    return np.concatenate([spread, 5.0 * lattice, [[1e9, 0.0, 0.0], [0.0, -3e8, 7.0]]])


@pytest.mark.parametrize('edge', [0.3, 5.0, 7.7, 1000.0])
def test_a_box_holds_the_points_in_it_in_the_order_given(points, edge):
    blocks, rng = PointBlocks(points), np.random.default_rng(1)
    for low in [*rng.uniform(-40, 40, (30, 3)), np.zeros(3), np.full(3, -5.0), np.full(3, -1e10)]:
        for size in (edge, 2.3 * edge, 2e10):
            inside = ((points >= low) & (points < low + size)).all(axis=1)
            np.testing.assert_array_equal(blocks.points_within(low, low + size), points[inside])


def test_what_is_not_finite_is_counted_and_left_out(points):
    spoilt = np.concatenate([points, [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 1e13]]])
    blocks = PointBlocks(spoilt)
    assert blocks.dropped == 3
    assert len(blocks) == len(points)
    np.testing.assert_array_equal(blocks.bounds, [points.min(axis=0), points.max(axis=0)])


def test_points_are_copied(points):
    mine = points.copy()
    blocks = PointBlocks(mine)
    mine += 1.0
    low, high = points.min(axis=0), points.max(axis=0) + 1.0
    np.testing.assert_array_equal(blocks.points_within(low, high), points)


def test_a_map_without_a_finite_point_is_refused():
    with pytest.raises(InvalidCloud, match='the map has 2 points and none is finite'):
        PointBlocks(np.full((2, 3), np.nan))
