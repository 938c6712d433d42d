import naive
import numpy as np
import pytest
from terrain import points_around

from idem_ros.core.maps.map_blocks import Level, MapBlocks
from idem_ros.core.maps.point_blocks import PointBlocks

EDGE = 16.0
RADIUS = 2.3


@pytest.fixture(scope='module')
def points():
    return points_around((0.0, 0.0), 24.0, np.random.default_rng(3))


def indices():
    return [(i, j, k) for i in range(-2, 2) for j in range(-2, 2) for k in range(-1, 1)]


def all_of(blocks, level):
    """The points of all blocks in the map's frame, their weights, and which block each is of."""
    found = [blocks.points(level, index) for index in indices()]
    points = [b.points + level.corner(i) for i, b in zip(indices(), found, strict=True)]
    return np.concatenate(points), np.concatenate([b.weights for b in found])


def test_the_voxels_of_all_blocks_hold_all_points(points):
    voxels, weights = all_of(MapBlocks(PointBlocks(points), 1 << 30), Level(EDGE, 1.0, 1.0))
    cells, counts = np.unique(np.floor(points).astype(int), axis=0, return_counts=True)
    order = np.lexsort(np.floor(voxels).astype(int).T[::-1])
    np.testing.assert_array_equal(np.floor(voxels[order]).astype(int), cells)
    np.testing.assert_array_equal(weights[order, 0], counts)


@pytest.mark.parametrize(
    ('finest', 'voxel_size'), [(1.0, 1.0), (1.0, 4.0), (0.5, 3.1), (None, None)]
)
def test_moments_are_those_of_the_ball_in_the_whole_map(points, finest, voxel_size):
    points = points[::7] if voxel_size is None else points
    blocks, level = MapBlocks(PointBlocks(points), 1 << 30), Level(EDGE, finest, voxel_size)
    voxels, weights = all_of(blocks, level)
    if voxel_size is None:
        weights = np.repeat([[1.0, 0, 0, 0, 0, 0, 0]], len(voxels), axis=0)
    for index in ((-1, 0, -1), (0, 0, 0), (1, -2, 0)):
        block, found = blocks.points(level, index), blocks.moments(level, RADIUS, index)
        for row in range(0, len(block.points), 9):
            centre = block.points[row] + level.corner(index)
            each = naive.moments(voxels, weights[:, 0], weights[:, 1:], centre, RADIUS)
            once = naive.moments(voxels, np.ones(len(voxels)), 0 * weights[:, 1:], centre, RADIUS)
            for moments, (k, s, outer) in ((found.own, each), (found.unit, once)):
                expected = [k, *s, *outer[np.triu_indices(3)]]
                np.testing.assert_allclose(moments[row], expected, rtol=1e-9, atol=1e-9)


def test_an_empty_block_is_empty(points):
    blocks, level = MapBlocks(PointBlocks(points), 1 << 30), Level(EDGE, 1.0, 1.0)
    assert len(blocks.points(level, (100, 0, 0)).points) == 0
    assert len(blocks.moments(level, RADIUS, (100, 0, 0)).own) == 0


def test_blocks_that_do_not_fit_are_let_go_of(points):
    blocks, level = MapBlocks(PointBlocks(points), 60_000), Level(EDGE, 1.0, 1.0)
    for index in indices():
        blocks.moments(level, RADIUS, index)
    assert blocks.bytes < 2 * 60_000
