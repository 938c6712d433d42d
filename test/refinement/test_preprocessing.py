import math

import numpy as np
import pytest

from idem_ros.core import InvalidCloud, InvalidConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig, preprocess


@pytest.fixture
def points(rng):
    return rng.uniform(-10, 10, (2000, 3))


def kept_of(points, **config):
    return preprocess(points, PreprocessingConfig(**config)).points


def test_by_default_every_point_takes_part(points):
    result = preprocess(points, PreprocessingConfig())
    assert result.points is points
    assert (result.cropped, result.thinned) == (0, 0)


def test_range_is_the_distance_from_the_origin_of_the_frame():
    points = np.array([[0.5, 0, 0], [0, 3.0, 4.0], [0, 0, -6.0], [3.0, 0, 4.0]])
    np.testing.assert_array_equal(kept_of(points, min_range=1.0), points[1:])
    np.testing.assert_array_equal(kept_of(points, max_range=5.0), points[[0, 1, 3]])
    np.testing.assert_array_equal(kept_of(points, min_range=1.0, max_range=5.0), points[[1, 3]])


def test_the_box_keeps_what_lies_in_it_and_on_its_border():
    points = np.array([[0.0, 0, 0], [1.0, 2, 3], [1.1, 0, 0], [0, -0.1, 0], [0, 0, 4.0]])
    kept = kept_of(points, crop_min=(0, 0, 0), crop_max=(1, 2, 3))
    np.testing.assert_array_equal(kept, points[:2])


def test_what_was_left_out_is_counted_by_reason(points):
    result = preprocess(points, PreprocessingConfig(max_range=8.0, max_points=300))
    inside = np.count_nonzero(np.linalg.norm(points, axis=1) <= 8.0)
    assert (result.cropped, result.thinned) == (2000 - inside, inside - 300)
    assert len(result.points) == 300


def test_a_map_is_cropped_on_request_only(points):
    config = PreprocessingConfig(max_range=5.0, max_points=1500)
    assert preprocess(points, config, is_target=True).cropped == 0
    assert preprocess(points, config, is_target=True).thinned == 500
    config = PreprocessingConfig(max_range=5.0, max_points=1500, crop_target=True)
    assert preprocess(points, config, is_target=True).cropped == preprocess(points, config).cropped


@pytest.mark.parametrize('most', [1, 7, 999, 1000, 1500, 1999, 2000, 5000])
def test_thinning_keeps_so_many_different_points_in_order(points, most):
    kept = kept_of(points, max_points=most)
    index = [int(np.flatnonzero((points == point).all(axis=1))[0]) for point in kept]
    assert len(index) == min(most, 2000)
    assert (np.diff(index) > 0).all()


def test_thinning_is_the_same_every_time_and_meets_every_ring(points):
    first, second = (kept_of(points, max_points=500) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    ring = np.arange(2000) % 4  # 500 is a quarter: a stride would meet one ring only
    met = [ring[np.flatnonzero((points == point).all(axis=1))[0]] for point in first]
    assert (np.bincount(met) > 80).all()


def test_a_cloud_with_nothing_left_is_refused_with_the_share_of_each_parameter():
    points = np.array([[0.1, 0, 0], [9.0, 0, 0], [9.0, 1, 0], [3.0, 0, 0]])
    config = PreprocessingConfig(min_range=1.0, max_range=5.0, crop_max=(2.0, 9.0, 9.0))
    with pytest.raises(InvalidCloud) as refused:
        preprocess(points, config)
    text = str(refused.value)
    assert 'none of its 4 points' in text
    assert '1 are nearer than min_range 1.0 m, 2 farther than max_range 5.0 m, 3 outside' in text
    with pytest.raises(InvalidCloud) as refused:
        preprocess(points[:1], PreprocessingConfig(min_range=1.0))
    assert 'max_range' not in str(refused.value)


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'min_range': -1.0}, 'min_range is -1.0'),
        ({'max_range': math.inf}, 'max_range is inf'),
        ({'min_range': 5.0, 'max_range': 5.0}, 'min_range is 5.0, max_range is 5.0'),
        ({'crop_min': (1.0, 2.0)}, 'crop_min is .*three numbers'),
        ({'crop_max': (1.0, 2.0, math.nan)}, 'crop_max is'),
        ({'crop_max': (1.0, 2.0, 'x')}, 'crop_max is'),
        ({'crop_min': (0, 5, 0), 'crop_max': (1, 4, 1)}, 'smaller in x, y and z'),
        ({'crop_target': 1}, 'crop_target is 1'),
        ({'max_points': 0}, 'max_points is 0'),
        ({'max_points': 1e5}, 'max_points is 100000.0'),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(change, message):
    with pytest.raises(InvalidConfig, match=message):
        PreprocessingConfig(**change)
