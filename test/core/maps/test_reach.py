"""What garbage may ask of a map is bounded by its points, whatever they are."""

import numpy as np
import pytest
from terrain import points_around

from idem_ros.core import MapCloud, RegistrationConfig, register
from idem_ros.core.maps import reach
from idem_ros.core.maps.point_blocks import PointBlocks
from idem_ros.core.maps.reach import Reach

N, EDGE = 3000, 32.0
BOUNDS = np.array([[-300.0, -300.0, -20.0], [300.0, 300.0, 20.0]])
GARBAGE = {
    'of any size': lambda rng: 10.0 ** rng.uniform(-8, 9, (N, 3)) * rng.choice([-1, 1], (N, 3)),
    'beyond whole numbers': lambda rng: rng.choice([-1e300, 1e300], (N, 3)),
    'all over the map': lambda rng: rng.uniform(*BOUNDS, (N, 3)),
    'in a line': lambda rng: np.linspace(*BOUNDS, N),
}


@pytest.mark.parametrize('name', GARBAGE)
@pytest.mark.parametrize('distance', [4.0, 1e12])
def test_cubes_and_blocks_are_bounded_by_the_points(rng, name, distance):
    found = Reach.around(GARBAGE[name](rng), EDGE, distance, BOUNDS)
    for each in (found, found.wider(distance)):
        assert len(each.codes) <= max(reach.MOST_CUBES, 125 * N)
        blocks, cubes = each.by_block()
        assert len(blocks) == len(cubes) <= max(reach.MOST_BLOCKS, N // reach.CUBES_OF_A_BLOCK)


def test_points_outside_of_the_map_have_no_cubes():
    far = BOUNDS[1] + 2 * EDGE
    found = Reach.around(np.array([far, -far, (0.0, 0.0, 0.0)]), EDGE, 4.0, BOUNDS)
    assert len(found.core) == 1


@pytest.mark.parametrize('voxel_size', [0.5, None])
def test_a_map_is_asked_for_no_more_blocks_than_that(rng, voxel_size):
    class Counting(PointBlocks):
        """A source that tells how often it was asked."""

        asked = 0

        def points_within(self, low, high):
            self.asked += 1
            return super().points_within(low, high)

    source = Counting(points_around((0.0, 0.0), 60.0, rng))
    points = GARBAGE['of any size'](rng)
    result = register(MapCloud(source), points, None, RegistrationConfig(voxel_size=voxel_size))
    assert not result.is_usable
    assert source.asked < 2000
