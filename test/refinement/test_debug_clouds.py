import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.refinement.debug_clouds import aligned_points, points_with_q


@pytest.fixture
def pair(rng):
    points = surface(rng, 500)
    T = motion(rng, 0.02, 0.02)
    return points, transform_points(inverse(T), points[::2]), T


@pytest.mark.parametrize('voxel_size', [None, 0.1])
def test_shares_of_the_points_sum_to_q_tot_at_the_result(pair, voxel_size):
    clouds = Cloud(pair[0]), Cloud(pair[1])
    config = RegistrationConfig(voxel_size=voxel_size)
    result = register(*clouds, None, config)
    points, q, cloud = points_with_q(result, *clouds, config)
    assert len(points) == len(q) == len(cloud)
    assert q.sum() == pytest.approx(result.q_tot, rel=1e-9)
    taken = [each.reduced(voxel_size) if voxel_size else each for each in clouds]
    assert [int((cloud == i).sum()) for i in (0, 1)] == [len(each) for each in taken]


def test_source_is_put_where_the_result_says(pair):
    target, source, T = pair
    moved = aligned_points(T, Cloud(source))
    np.testing.assert_allclose(moved, transform_points(T, source), rtol=0, atol=1e-12)
    points, _, cloud = points_with_q(
        register(target, source), Cloud(target), Cloud(source), RegistrationConfig()
    )
    np.testing.assert_allclose(points[cloud == 0], target, rtol=0, atol=1e-12)


def test_points_beyond_all_measure_are_left_out_of_points_and_shares_alike(pair):
    target = Cloud(np.append(pair[0], [[1e300, 0, 0]], axis=0))
    source = Cloud(pair[1])
    points, q, cloud = points_with_q(
        register(target, source), target, source, RegistrationConfig()
    )
    assert len(points) == len(q) == len(cloud) == len(target) + len(source)
    assert np.isfinite(q).all()


def test_too_few_points_have_no_shares():
    few = Cloud(np.eye(3)), Cloud(np.eye(3))
    points, q, _ = points_with_q(register(*few), *few, RegistrationConfig())
    assert (len(points), q.any()) == (6, False)
