import numpy as np
import pytest
from clouds import motion, surface

from benchmarks.case import (
    LEVELS,
    Case,
    displaced,
    displacement,
    errors,
    starts,
    succeeded,
)
from idem_ros.core import fourth_neighbor_distance
from idem_ros.core.geometry import se3


@pytest.fixture
def case(rng):
    truth = motion(rng, 30, 2.0)
    points = surface(rng, 400)
    source = se3.transform_points(se3.inverse(truth), surface(rng, 400)) + (5.0, 0.0, 0.0)
    return Case('two halves', points, source, truth)


def test_starts_are_off_by_exactly_a_level(case):
    for level in LEVELS:
        for start in starts(case, level, 3):
            rotation_deg, translation_m = errors(case, start)
            assert rotation_deg == pytest.approx(level[1])
            assert translation_m == pytest.approx(level[0] * case.spacing)


def test_starts_are_the_same_in_every_run_and_differ_by_level_and_name(case):
    other = Case('another', case.target, case.source, case.truth)
    first = starts(case, LEVELS[0], 4)
    assert np.array_equal(first[:2], starts(case, LEVELS[0], 2))
    assert not np.allclose(first[0], first[1])
    assert not np.allclose(first[0], starts(other, LEVELS[0], 1)[0])
    assert not np.allclose(first[0][:3, :3], starts(case, LEVELS[1], 1)[0][:3, :3])


def test_the_translation_error_is_that_of_the_sources_centroid(case, rng):
    turned = displaced(case.truth, case.centroid, 3.0, 0.0, rng)
    rotation_deg, translation_m = errors(case, turned)
    assert rotation_deg == pytest.approx(3.0)
    assert translation_m == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(turned[:3, 3] - case.truth[:3, 3]) > 0.1


def test_the_spacing_is_that_of_the_clouds_as_registered(rng):
    points = surface(rng, 2000)
    raw = Case('raw', points, points, np.eye(4))
    voxels = Case('voxels', points, points, np.eye(4), voxel_size=0.2)
    assert raw.spacing == pytest.approx(fourth_neighbor_distance(points))
    assert voxels.spacing > 2.0 * raw.spacing


def test_success_takes_both_errors_below_their_bounds(case):
    assert succeeded(case, 0.99, 0.49 * case.spacing)
    assert not succeeded(case, 1.01, 0.0)
    assert not succeeded(case, 0.0, 0.51 * case.spacing)


def test_a_transform_that_is_not_finite_is_as_wrong_as_can_be(case):
    broken = np.full((4, 4), np.nan)
    assert errors(case, broken) == (180.0, np.inf)
    assert not succeeded(case, *errors(case, broken))


def test_displacement_is_how_far_points_move_in_spacings(case):
    assert displacement(case, 0.0, case.spacing) == pytest.approx(1.0)
    off = displaced(case.truth, case.centroid, 1.0, 0.0, np.random.default_rng(1))
    between = se3.transform_points(off, case.source) - se3.transform_points(
        case.truth, case.source
    )
    moved = np.sqrt(np.mean(np.sum(between**2, axis=1))) / case.spacing
    assert displacement(case, 1.0, 0.0) == pytest.approx(moved, rel=0.35)
