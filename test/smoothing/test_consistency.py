import numpy as np
import pytest

from idem_ros.core.geometry.voxels import reduce_to_voxels
from idem_ros.core.metric.moments import AS_MEASURED
from idem_ros.smoothing.consistency import (
    LEAST_SPREAD,
    MapRows,
    consistency_of,
    entropy_of,
    merged,
)

EDGE, NOISE = 1.0, 0.02


def wall(rng, offset=0.0, points=4000):
    """Points of a plane z = 0.5 of 10 x 10, with noise across it."""
    xy = rng.uniform(0.0, 10.0, (points, 2))
    return np.column_stack([xy, 0.5 + offset + rng.normal(0.0, NOISE, points)])


def rows_of(*scans):
    parts = [reduce_to_voxels(points, AS_MEASURED, 0.25, np.zeros(3)) for points in scans]
    scan = np.repeat(np.arange(len(scans)), [len(part.mean) for part in parts])
    mean, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
    return MapRows(mean, weights, scan)


def score(*scans, gap=np.inf, along=None):
    along = np.arange(len(scans), dtype=float) if along is None else along
    return consistency_of(rows_of(*scans), along, EDGE, gap)


def test_scans_that_agree_score_about_zero_and_cells_of_one_scan_do_not_count(rng):
    found = score(wall(rng), wall(rng), wall(rng) + (20.0, 0.0, 0.0))
    assert found.cells == 100
    assert abs(found.score) < 0.05


def test_the_score_is_the_entropy_that_the_offset_adds(rng):
    found = score(wall(rng), wall(rng, 0.1))
    # the variance of two means 0.1 apart, beside that of the noise
    own = NOISE**2 + LEAST_SPREAD**2 * EDGE**2
    assert found.score == pytest.approx(0.5 * np.log1p(0.1**2 / 2 / own), rel=0.1)


def test_cells_whose_scans_show_no_flat_surface_do_not_count(rng):
    solid = rng.uniform(0.0, 10.0, (2, 20_000, 3))
    assert score(*solid).cells < 20  # of a thousand


@pytest.mark.parametrize('thinner', [1, 3, 10])
def test_density_does_not_change_the_score(rng, thinner):
    dense = score(wall(rng, 0.0, 20_000), wall(rng, 0.05, 20_000)).score
    found = score(wall(rng, 0.0, 20_000), wall(rng, 0.05, 20_000 // thinner)).score
    assert found == pytest.approx(dense, rel=0.1)


def test_passes_meet_where_the_way_between_two_scans_is_long(rng):
    scans = wall(rng), wall(rng), wall(rng, 0.1) + (5.0, 0.0, 0.0)
    found = score(*scans, gap=5.0, along=np.array([0.0, 1.0, 50.0]))
    assert found.cells == 100
    assert found.cells_met == 50
    assert found.score_met > 3 * found.score / 2
    assert score(*scans, gap=100.0, along=np.array([0.0, 1.0, 50.0])).score_met is None


def test_parts_add_up_to_the_whole(rng):
    rows = rows_of(wall(rng), wall(rng, 0.05))
    is_left = rows.mean[:, 0] < 5.0
    halves = [MapRows(*(each[which] for each in rows)) for which in (is_left, ~is_left)]
    along = np.zeros(2)
    left, right = (consistency_of(half, along, EDGE, 1.0) for half in halves)
    whole = consistency_of(rows, along, EDGE, 1.0)
    assert left.plus(right).cells == whole.cells
    assert left.plus(right).q == pytest.approx(whole.q)


def test_a_map_keeps_the_points_and_their_scatter(rng):
    points = wall(rng)
    mean, weights = merged(rows_of(points[:1000], points[1000:]), 0.5)
    assert weights[:, 0].sum() == len(points)
    np.testing.assert_allclose(weights[:, 0] @ mean / len(points), points.mean(axis=0))
    own, expected = reduce_to_voxels(points, AS_MEASURED, 0.5, np.zeros(3))
    # a voxel of one may straddle a cell of the other only where it holds points of both
    assert len(mean) == len(own)
    assert weights[:, 6].sum() == pytest.approx(expected[:, 6].sum())


def test_mean_map_entropy_is_that_of_the_points_in_balls(rng):
    points = rng.normal(size=(3000, 3))
    once = np.broadcast_to(AS_MEASURED, (len(points), 7))
    found = entropy_of(points, once, np.ones(len(points), bool), 0.6)
    h = []
    for p in points:
        near = points[np.linalg.norm(points - p, axis=1) <= 0.6]
        det = np.linalg.det(2 * np.pi * np.e * np.cov(near.T, bias=True)) if len(near) > 4 else 0
        h += [0.5 * np.log(det)] if det > 0 else []
    assert found.points == len(h)
    assert found.mean_map_entropy == pytest.approx(np.mean(h))


def test_nothing_meets_in_a_map_of_one_scan(rng):
    found = score(wall(rng))
    assert (found.score, found.score_met, found.mean_map_entropy) == (None, None, None)
