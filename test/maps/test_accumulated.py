"""A map that comes in parts."""

import numpy as np
import pytest

from idem_ros.maps.accumulated import AccumulatedMap

EVERYWHERE = (-1e4, -1e4, -1e4), (1e4, 1e4, 1e4)


def put_together(parts, radius=150.0, voxel_size=0.5):
    grown = None
    for points in parts:
        grown = AccumulatedMap(lambda points=points: points, grown, radius, voxel_size)
    return grown


@pytest.fixture
def parts(rng):
    return [rng.uniform((x, -20, 0), (x + 40, 20, 4), (4000, 3)) for x in (-30, 0, 30, 60)]


def test_of_each_voxel_the_first_point_is_kept(parts):
    everything = np.concatenate(parts)
    voxels = np.floor(everything / 0.5)
    first = np.sort(np.unique(voxels, axis=0, return_index=True)[1])
    found = put_together(parts).points_within(*EVERYWHERE)
    assert sorted(map(tuple, found)) == sorted(map(tuple, everything[first]))


def test_it_is_the_same_whether_each_part_was_asked_for_or_only_the_last(parts):
    whole, grown = put_together(parts), None
    for points in parts:
        grown = AccumulatedMap(lambda points=points: points, grown, 150.0, 0.5)
        grown.points_within(*EVERYWHERE)
    np.testing.assert_array_equal(
        grown.points_within(*EVERYWHERE), whole.points_within(*EVERYWHERE)
    )


def test_a_part_changes_nothing_of_the_map_before_it(parts):
    before = put_together(parts[:2])
    found = before.points_within(*EVERYWHERE)
    AccumulatedMap(lambda: parts[2], before, 150.0, 0.5).points_within(*EVERYWHERE)
    np.testing.assert_array_equal(before.points_within(*EVERYWHERE), found)


def test_the_points_of_a_box_are_those_that_lie_in_it(parts):
    grown = put_together(parts)
    everything = grown.points_within(*EVERYWHERE)
    low, high = np.array([-10.0, -5.0, 1.0]), np.array([45.0, 7.0, 2.0])
    inside = everything[((everything >= low) & (everything < high)).all(axis=1)]
    assert sorted(map(tuple, grown.points_within(low, high))) == sorted(map(tuple, inside))
    assert (grown.bounds[0] <= everything).all()
    assert (grown.bounds[1] >= everything).all()
    assert grown.points_within((500, 500, 0), (501, 501, 1)).shape == (0, 3)


def test_what_is_far_from_the_scans_is_forgotten_with_the_next_part(rng):
    far = rng.uniform((1000, 0, 0), (1010, 10, 4), (100, 3))
    near = rng.uniform((0, 0, 0), (10, 10, 4), (100, 3))
    grown = put_together([far])
    assert len(grown) > 0
    grown.keep_near((0.0, 0.0, 0.0), 50.0)
    assert len(grown) > 0
    grown = AccumulatedMap(lambda: near, grown, 150.0, 0.5)
    assert grown.bounds[1, 0] < 11.0
