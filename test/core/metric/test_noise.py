import naive
import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, RegistrationConfig, register
from idem_ros.core.metric import noise
from idem_ros.core.metric.cloud import neighbourhoods
from idem_ros.core.metric.moments import covariance
from idem_ros.core.metric.noise import quantile, widening


def plane(rng, sigma):
    return np.c_[rng.random((20000, 2)), rng.normal(size=20000) * sigma]


def of_many_kinds(rng):
    """Values alike, with ties, far apart, few, all the same, next to nothing, and a stray."""
    yield rng.random(5000)
    yield rng.pareto(0.2, 3000)
    yield rng.integers(0, 5, 700).astype(float)
    yield np.full(90, 7.0)
    yield 5e-324 * rng.integers(0, 3, 200)
    yield np.r_[rng.normal(size=1000), 1e300, -1e300]
    for count in (1, 2, 32, 33):
        yield rng.random(count)


@pytest.mark.parametrize('share', [0.0, 1 / 3, 0.5, 0.9, 0.9995, 1.0])
def test_a_quantile_is_that_of_numpy(rng, share):
    for values in of_many_kinds(rng):
        given = values.copy()
        assert quantile(values, share) == pytest.approx(
            np.quantile(values, share), rel=1e-12, abs=0.0
        )
        np.testing.assert_array_equal(values, given)


def test_covariances_are_those_of_the_members(rng):
    cloud = Cloud(rng.random((200, 3)))
    own = neighbourhoods([cloud], 0.4)[0]
    for p, moments in zip(own.grid.points[:10], own.own, strict=False):
        expected = np.cov(naive.ball(cloud.points, p, 0.4).T, bias=True)
        np.testing.assert_allclose(
            naive.symmetric(covariance(tuple(moments))), expected, atol=1e-12
        )


@pytest.mark.parametrize('sigma', [0.001, 0.004])
@pytest.mark.parametrize('voxel_size', [None, 0.04])
def test_the_thickness_of_a_plane_is_its_noise(rng, sigma, voxel_size):
    cloud = Cloud(plane(rng, sigma))
    cloud = cloud if voxel_size is None else cloud.reduced(voxel_size)
    thickness, members = cloud.thickness(0.06)
    assert members > 50
    assert 0.8 * sigma < thickness < 1.1 * sigma


def test_balls_are_widened_only_where_noise_fills_them(rng):
    exact, noisy = ([Cloud(surface(rng, 4000, sigma)) for _ in range(2)] for sigma in (0.0, 0.015))
    assert widening(*exact, 0.06) == 1.0
    assert widening(*noisy, 0.06) > 1.5
    assert widening(exact[0], noisy[0], 0.06) == pytest.approx(widening(noisy[0], exact[0], 0.06))


def test_too_few_members_say_nothing(rng):
    lonely = Cloud(rng.random((50, 3)) * 1000)
    assert widening(lonely, lonely, 0.1) == 1.0


def test_a_noisy_pair_is_registered_over_wider_balls(rng):
    def radius(sigma):
        target, source = surface(rng, 3000, sigma), surface(rng, 3000, sigma)
        return register(target, source, motion(rng, 1, 0.01), RegistrationConfig()).radius

    assert radius(0.02) > 1.4 * radius(0.0)


def test_members_along_lines_are_not_asked_for_noise(rng):
    """Rings of a LiDAR: each is exact across itself, and hides what the surface's noise is."""
    lines = np.repeat(np.arange(20) * 0.3, 400)
    rings = np.c_[lines, rng.random(8000) * 3, np.zeros(8000)]
    sheet = plane(rng, 0.004)
    cloud = Cloud(np.vstack([rings + (0, 0, 5), sheet]))
    thickness, _ = cloud.thickness(0.06)
    assert 0.8 * 0.004 < thickness < 1.1 * 0.004


@pytest.mark.parametrize('size', [(1, 1, 1), (1, 1, 0.2), (1, 1, 0.01), (1, 0.02, 0.01)])
def test_volumes_are_told_by_the_covariances_of_the_balls(rng, size):
    cloud = Cloud(rng.normal(size=(400, 3)) * size)
    own = neighbourhoods([cloud], 0.5)[0]
    expected = []
    for moments in own.own:
        values = np.linalg.eigvalsh(naive.symmetric(covariance(tuple(moments))))
        minors = values[0] * values[1] + values[0] * values[2] + values[1] * values[2]
        if moments[0] >= noise.LEAST_MEMBERS:
            expected.append(9 * values.prod() / (minors * values.sum()))
    share = np.mean(np.array(expected) > noise.ISOTROPIC)
    assert noise.shapes_of(own.own).volumes == pytest.approx(share, abs=1e-3)


def test_a_plane_is_no_volume_and_points_at_random_are(rng):
    volume = Cloud(rng.random((3000, 3)))
    sheet = neighbourhoods([Cloud(plane(rng, 0.002))], 0.05)[0].own
    filled = neighbourhoods([volume], 0.15)[0].own
    assert noise.shapes_of(sheet) == (1.0, 0.0)
    assert noise.shapes_of(filled).volumes > 0.9
    assert noise.shapes_of(np.zeros((5, 10))) == (0.0, 0.0)
