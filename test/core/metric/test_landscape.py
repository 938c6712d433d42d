import naive
import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import (
    Cloud,
    InvalidCloud,
    InvalidConfig,
    InvalidTransform,
    q_tot,
    search_radius,
)
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import Landscape


@pytest.fixture
def transforms(rng):
    return np.array([np.eye(4), *(motion(rng, 10 * rng.random(), 0.4) for _ in range(40))])


@pytest.mark.parametrize('sizes', [(300, 200), (200, 300)])
@pytest.mark.parametrize('length_scale', ['radius', 'none'])
def test_equals_q_tot_whichever_cloud_is_smaller(rng, transforms, sizes, length_scale):
    target, source = surface(rng, sizes[0]) + (3, 2, 1), surface(rng, sizes[1])
    transforms[:, :3, 3] += (3, 2, 1)
    landscape = Landscape(target, source, length_scale=length_scale)
    expected = [q_tot(target, source, T, length_scale=length_scale) for T in transforms]
    assert min(expected) > 0.001
    np.testing.assert_allclose(landscape.at(transforms), expected, rtol=1e-10)


def test_equals_the_equations_and_counts_who_has_a_neighbour_across(rng, transforms):
    target, source, radius = surface(rng, 90), surface(rng, 60), 0.3
    values = Landscape(target, source, radius, 'none').values(transforms)
    for T, q, within in zip(transforms, *values, strict=True):
        moved = se3.transform_points(T, source)
        assert q == pytest.approx(naive.q_per_point(target, moved, radius, 1.0).sum(), rel=1e-9)
        near = np.linalg.norm(target[:, None] - moved, axis=2) <= radius
        assert within == near.any(axis=1).sum() + near.any(axis=0).sum()


def test_threads_change_no_bit(rng, transforms):
    target, source = Cloud(surface(rng, 500)), Cloud(surface(rng, 400))
    one, three = (Landscape(target, source, threads=n).values(transforms) for n in (1, 3))
    np.testing.assert_array_equal(one, three)


def test_one_transform_gives_the_same_bits_alone_as_among_others(rng, transforms):
    landscape = Landscape(surface(rng, 300), surface(rng, 200))
    alone = [landscape.at(T[None])[0] for T in transforms]
    np.testing.assert_array_equal(landscape.at(transforms), alone)


def test_identical_clouds_give_zero_in_place_and_apart(rng):
    cloud = surface(rng, 300)
    apart = np.eye(4)
    apart[0, 3] = 50
    q, within = Landscape(cloud, cloud).values([np.eye(4), apart])
    np.testing.assert_allclose(q, 0, atol=1e-9)
    np.testing.assert_array_equal(within, [600, 0])


def test_no_radius_means_that_of_eq_9(rng):
    target, source = surface(rng, 300), surface(rng, 200)
    assert Landscape(target, source).radius == search_radius(target, source)


def test_no_transform_gives_no_value(rng):
    cloud = surface(rng, 20)
    assert Landscape(cloud, cloud).at(np.empty((0, 4, 4))).shape == (0,)


def test_points_all_in_one_place_have_no_entropy():
    q, within = Landscape(np.ones((10, 3)), np.ones((10, 3))).values([np.eye(4)])
    assert (q[0], within[0]) == (0, 0)


def test_a_rotation_rounded_in_a_file_is_made_whole(rng):
    target, source = surface(rng, 200), surface(rng, 200)
    rounded = np.round(motion(rng, 5, 0.1), 5)
    assert Landscape(target, source).at([rounded])[0] == pytest.approx(
        q_tot(target, source, rounded), rel=1e-10
    )


@pytest.mark.parametrize(
    ('transforms', 'message'),
    [
        (np.eye(4), r'shape \(4, 4\); they must be \(K, 4, 4\)'),
        ('identity', 'not matrices of numbers'),
        ([np.eye(4), 2 * np.eye(4)], r'transforms\[1\] has the last row'),
        ([np.diag([1, 1, -1, 1])], r'transforms\[0\] is not rigid'),
        ([np.full((4, 4), np.nan)], r'transforms\[0\] holds values that are not finite'),
    ],
)
def test_what_is_no_motion_is_refused(rng, transforms, message):
    cloud = surface(rng, 20)
    with pytest.raises(InvalidTransform, match=message):
        Landscape(cloud, cloud).at(transforms)


@pytest.mark.parametrize(
    ('arguments', 'error', 'message'),
    [
        ({'target': np.zeros((4, 2))}, InvalidCloud, 'shape'),
        ({'source': np.zeros((4, 3))}, InvalidCloud, 'no fourth neighbour'),
        ({'radius': 0}, InvalidConfig, 'radius is 0'),
        ({'radius': 'wide'}, InvalidConfig, "radius is 'wide'"),
        ({'length_scale': 'mm'}, InvalidConfig, "length_scale is 'mm'"),
        ({'threads': 0}, InvalidConfig, 'threads is 0'),
    ],
)
def test_misuse_is_refused(rng, arguments, error, message):
    clouds = {'target': surface(rng, 20), 'source': surface(rng, 20)}
    with pytest.raises(error, match=message):
        Landscape(**{**clouds, **arguments})
