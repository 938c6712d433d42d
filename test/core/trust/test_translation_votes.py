"""How far what lies across a way must slide: votes of a few plates, and of many alike."""

import numpy as np
import pytest
from clouds import motion

from idem_ros.core.geometry import se3
from idem_ros.core.trust.surfaces import ACROSS
from idem_ros.core.trust.translation_votes import (
    ALIKE,
    BIN,
    BLUR,
    MOST,
    MOST_WAYS,
    PARTS,
    Slide,
    slide_along,
    smear_along,
)

AHEAD = np.array([1.0, 0.0, 0.0])
RADIUS = 0.5


def plates(places):
    """Return points on plates across x at some places, and their normals."""
    y, z = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5))
    points = [np.c_[np.full(y.size, x), y.ravel() + shift, z.ravel()] for x, shift in places]
    return np.concatenate(points), np.tile(AHEAD, (y.size * len(places), 1))


def slide(here, there, reach=20.0):
    return slide_along(plates(here), plates(there), np.eye(4), AHEAD, RADIUS, reach)


def test_plates_at_unlike_distances_vote_for_one_way():
    places = [(0.0, 0.0), (2.0, 4.0), (7.0, -4.0)]
    found = slide(places, [(x - 1.5, y) for x, y in places])
    assert found.way == pytest.approx(1.5, abs=0.05 * RADIUS + 0.02)
    assert found.is_clear()


def test_plates_in_a_row_have_a_rival_however_far():
    found = slide([(0.0, 0.0), (9.0, 0.0)], [(0.0, 0.0)])
    assert not found.is_clear()
    assert slide([(0.0, 0.0), (9.0, 0.0)], [(0.0, 0.0)], reach=5.0).is_clear()


def test_votes_rise_where_plates_coincide_and_nowhere_else():
    found = slide([(0.0, 0.0), (9.0, 0.0)], [(0.0, 0.0)])
    near, around = 0.3 * RADIUS, 4.0
    assert found.rises(9.0, near, around) == pytest.approx(1.0)
    assert found.rises(4.5, near, around) == 0.0
    assert found.rises(100.0, near, around) == 0.0


def test_what_has_votes_everywhere_rises_little_but_at_its_most():
    votes = np.full(401, 60.0)
    votes[150], votes[300] = 100.0, 90.0
    found = Slide(0.1 * (150 - 200), 100.0, 90.0, votes, 0.1)
    assert found.rises(10.0, 0.1, 5.0) == pytest.approx(0.75)
    assert found.rises(3.0, 0.1, 5.0) == 0.0


def votes_one_by_one(target, source, T, direction, reach):
    """The votes for each way, of pairs in turn."""
    half = int(np.ceil(reach / (BIN * RADIUS)))
    votes = np.zeros(2 * half + 1)
    moved = se3.transform_points(T, source[0]), source[1] @ T[:3, :3].T
    both = []
    for places, normals in (target, moved):
        across = np.flatnonzero(np.abs(normals @ direction) > ACROSS)
        some = across[:: max(len(across) // MOST, 1)]
        both.append((places[some], normals[some], len(across) / len(some)))
    (here, here_normals, each), (there, there_normals, each_there) = both
    for a, n in zip(here, here_normals, strict=True):
        apart, along = a - there, (a - there) @ direction
        beside = np.linalg.norm(apart - along[:, None] * direction, axis=1)
        way = apart @ n / (n @ direction)
        bins = np.floor(way / (BIN * RADIUS) + 0.5).astype(int) + half
        counts = (there_normals @ n >= ALIKE) & (beside <= RADIUS)
        counts &= (np.abs(way - along) < RADIUS) & (bins >= 0) & (bins < len(votes))
        weight = np.abs((n @ direction) * (there_normals @ direction))
        np.add.at(votes, bins[counts], each * each_there * weight[counts])
    return np.convolve(votes, BLUR, 'same')


@pytest.mark.parametrize('many', [300, 2 * MOST + 1])
def test_every_pair_of_surfaces_across_the_way_votes(rng, many):
    def strewn(count):
        normals = rng.normal(size=(count, 3)) * (2.0, 1.0, 1.0)
        return 3.0 * rng.random((count, 3)), normals / np.linalg.norm(normals, axis=1)[:, None]

    target, source = strewn(200), strewn(many)
    T, direction = motion(rng, 10.0, 0.5), se3.exp(rng.normal(size=6) / 5)[:3, 0]
    found = slide_along(target, source, T, direction, RADIUS, 4.0)
    expected = votes_one_by_one(target, source, T, direction, 4.0)
    np.testing.assert_allclose(found.of_each, expected, rtol=1e-9, atol=1e-9)
    assert found.votes > 1.0


def test_the_ways_of_clouds_of_any_extent_are_bounded():
    found = slide([(0.0, 0.0), (9.0, 0.0)], [(0.0, 0.0)], reach=1e15)
    assert len(found.of_each) <= 2 * MOST_WAYS + 1
    assert found.votes > 0.0


@pytest.mark.parametrize('fraction', [0.0, 0.5])
@pytest.mark.parametrize('smear', [-3.0, 0.0, 2.0])
def test_plates_seen_at_unlike_times_tell_how_far_the_sensor_went(smear, fraction):
    places = [(0.0, 0.0), (2.0, 4.0), (7.0, -4.0), (-5.0, 8.0)]
    parts = np.array([2, 11, 20, 30])
    after = (parts + 0.5) / PARTS - fraction
    seen = [(x - 1.5 - smear * s, y) for (x, y), s in zip(places, after, strict=True)]
    of_each = np.repeat(parts, 25)
    source = *plates(seen), of_each
    reach = RADIUS, 6.0
    found = smear_along(plates(places), source, np.eye(4), AHEAD, reach, fraction)
    assert found == pytest.approx(smear, abs=0.15 * RADIUS + 0.02)
