from types import SimpleNamespace

import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, RegistrationConfig, q_tot, register
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.refinement import debug_clouds
from idem_ros.refinement.debug_clouds import STEPS, NoSlice, slice_around, slice_of

VOXELS = RegistrationConfig(voxel_size=0.1)


@pytest.fixture
def clouds(rng):
    points = surface(rng, 400)
    T = motion(rng, 0.02, 0.02)
    return Cloud(points), Cloud(transform_points(inverse(T), points[::2]))


@pytest.fixture
def pair(rng):
    """Target, source, and where the source is."""
    T = motion(rng, 20.0, 0.5)
    return surface(rng, 600), transform_points(inverse(T), surface(rng, 600)), T


def refined(clouds, config, guess=None):
    guess = np.eye(4) if guess is None else guess
    result = register(*clouds, guess, config)
    return SimpleNamespace(T_guess=guess, result=result, took_part=(*clouds, config))


def test_slice_holds_q_tot_at_each_shift_rows_along_y(clouds):
    config = RegistrationConfig(voxel_size=0.1)
    refinement = refined(clouds, config)
    slice_ = slice_of(refinement)
    assert slice_.q_tot.shape == (STEPS, STEPS)
    for row, column in ((12, 12), (3, 20)):
        shifted = refinement.result.T_target_source.copy()
        shifted[:2, 3] += slice_.shifts[column], slice_.shifts[row]
        reduced = [each.reduced(0.1) for each in clouds]
        expected = q_tot(*reduced, shifted, radius=refinement.result.radius)
        assert slice_.q_tot[row, column] == pytest.approx(expected, rel=1e-9)


def test_slice_reaches_as_far_as_the_guess_but_no_farther_than_ten_radii(clouds):
    config = RegistrationConfig(voxel_size=0.1)
    refinement = refined(clouds, config)
    radius = refinement.result.radius
    assert slice_of(refinement).shifts[-1] >= 2.5 * radius
    refinement.T_guess[0, 3] += 1000.0
    far = slice_of(refinement)
    assert far.shifts[-1] == pytest.approx(10.0 * radius)


def test_slice_says_in_a_sentence_what_it_shows(clouds):
    config = RegistrationConfig(voxel_size=0.1)
    text = str(slice_of(refined(clouds, config)))
    assert 'on 25 x 25 cells of ' in text
    assert 'the region of interest covers ' in text


def test_result_without_a_radius_has_no_slice():
    few = Cloud(np.eye(3)), Cloud(np.eye(3))
    with pytest.raises(NoSlice, match='too_few_points'):
        slice_of(refined(few, RegistrationConfig()))


def test_a_map_far_larger_than_the_source_changes_nothing(pair, rng):
    target, source, T = pair
    near = slice_around(*pair, T, 0.3, VOXELS)
    far = np.vstack([target, rng.uniform(100, 200, (500, 3))])
    again = slice_around(far, source, T, T, 0.3, VOXELS)
    np.testing.assert_allclose(again.q_tot, near.q_tot, rtol=1e-9)


def test_of_large_clouds_coarser_voxels_are_taken(pair, monkeypatch):
    monkeypatch.setattr(debug_clouds, 'MOST_POINTS', 200)
    found = slice_around(*pair, pair[2], 0.3, VOXELS)
    assert found.voxel_size > 0.1
    assert found.radius > 0.3
    assert np.isfinite(found.q_tot).all()


def test_clouds_that_do_not_meet_have_a_slice_of_zeros(pair):
    target, source, T = pair
    found = slice_around(target + 1000.0, source, T, T, 0.3, VOXELS)
    np.testing.assert_array_equal(found.q_tot, 0.0)
