import numpy as np
import pytest
from clouds import motion, surface
from scipy.optimize import minimize_scalar

from idem_ros.core import InvalidConfig, InvalidTransform
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import Landscape, q_on_grid
from idem_ros.core.metric.region_of_interest import (
    STEPS_PER_RADIUS,
    nearest_maximum,
    region_along_axes,
    region_on_grid,
)


def entropy_between_sheets(z):
    """Eq. 4 for a ball of radius 1 about a point of one dense sheet, another one z above it."""
    above = (1 - z**2) / (2 - z**2)  # of the members
    along = (1 - above) / 4 + above * (1 - z**2) / 4
    det = along**2 * above * (1 - above) * z**2
    return 0.5 * np.log1p((2 * np.pi * np.e) ** 3 * det)


def test_two_sheets_have_their_crown_where_the_equation_has_its_maximum():
    side = np.arange(-2, 2, 0.1)
    sheet = np.array([(x, y, 0.0) for x in side for y in side])
    region = region_along_axes(Landscape(sheet, sheet, radius=1.0), farthest=1.2)
    best = minimize_scalar(lambda z: -entropy_between_sheets(z), bounds=(0, 1), method='bounded')
    np.testing.assert_allclose(region.extent[2], (-best.x, best.x), atol=1.5 / STEPS_PER_RADIUS)
    assert region.q_pose == pytest.approx(0, abs=1e-9)


def test_the_region_turns_and_moves_with_the_pose(rng):
    cloud, T = surface(rng, 300), motion(rng, 70, 3.0)
    at_identity = region_along_axes(Landscape(cloud, cloud))
    away = se3.transform_points(se3.inverse(T), cloud)
    moved = region_along_axes(Landscape(cloud, away, at_radius(cloud)), T)
    np.testing.assert_allclose(moved.extent, at_identity.extent, atol=1e-9)
    assert at_identity.closed
    assert (at_identity.extent[:, 0] < 0).all()
    assert (at_identity.extent[:, 1] > 0).all()
    assert (at_identity.crown > at_identity.q_pose + 1).all()


def at_radius(cloud):
    return Landscape(cloud, cloud).radius


def test_an_axis_looked_along_too_briefly_has_no_maximum(rng):
    cloud = surface(rng, 300)
    region = region_along_axes(Landscape(cloud, cloud), farthest=0.1 * at_radius(cloud))
    assert not region.closed
    assert np.isnan(region.extent[0]).all()


def test_the_crown_encloses_the_pose_on_a_grid(rng):
    cloud = surface(rng, 400)
    landscape = Landscape(cloud, cloud)
    x = np.linspace(-3, 3, 25) * landscape.radius
    q = q_on_grid(landscape, x=x, y=x)
    region = region_on_grid(q, x[1] - x[0])
    assert region.closed
    assert region.inside[12, 12]
    assert region.minimum == (12, 12)
    assert region.q_idem == pytest.approx(0, abs=1e-9)
    assert region.lowest_pass <= q.max()


def test_a_ripple_is_no_maximum():
    x = np.linspace(0, 4, 401)
    q = np.exp(-((x - 1) ** 2) / 0.1) + 0.02 * np.sin(40 * x)
    assert x[nearest_maximum(q)] == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize('q', [[0, 1, 2, 3], [0, 0, 0, 0]])
def test_a_side_without_a_fall_has_no_maximum(q):
    assert nearest_maximum(q) is None


@pytest.mark.parametrize(('dimensions', 'expected'), [(1, 1.0), (2, np.pi * 0.25), (3, np.pi / 6)])
@pytest.mark.parametrize('noise', [0.0, 0.002])
def test_a_round_crown_holds_a_ball(rng, dimensions, expected, noise):
    x = np.linspace(-1, 1, 41)
    r2 = sum(c**2 for c in np.meshgrid(*[x] * dimensions))
    q = r2 * np.exp(-4 * r2) + noise * rng.random(r2.shape)  # greatest at 0.5
    region = region_on_grid(q, 0.05)
    assert region.measure == pytest.approx(expected, rel=0.1)
    assert region.closed
    assert region.lowest_pass == pytest.approx(0.25 / np.e, rel=0.05)


def passes(q, starts):
    """The lowest pass from each point to the starts, by relaxing until nothing changes."""
    best = np.where(starts, q, np.inf)
    for _ in range(q.size):
        padded = np.pad(best, 1, constant_values=np.inf)
        around = [padded[1 + i : 1 + i + q.shape[0], 1 + j : 1 + j + q.shape[1]]
                  for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1))]  # fmt: skip
        best = np.minimum(best, np.maximum(q, np.min(around, axis=0)))
    return best


def test_inside_is_what_has_a_lower_pass_to_the_pose_than_to_the_edge(rng):
    for _ in range(10):
        q = rng.random((9, 11))
        pose, edge = np.zeros(q.shape, bool), np.ones(q.shape, bool)
        pose[4, 5], edge[1:-1, 1:-1] = True, False
        to_pose, to_edge = passes(q, pose), passes(q, edge)
        inside = region_on_grid(q, 1.0).inside
        assert inside[to_pose < to_edge].all()
        assert not inside[to_pose > to_edge].any()


def test_a_crown_beyond_the_grid_is_told(rng):
    x = np.linspace(-1, 1, 21)
    assert not region_on_grid(np.add.outer(x**2, x**2), 0.1).closed


def test_the_pose_may_lie_off_the_middle():
    x = np.linspace(-1, 2, 61)
    q = x**2 * np.exp(-4 * x**2)
    region = region_on_grid(q, 0.05, pose=[20])
    np.testing.assert_allclose(x[region.inside][[0, -1]], (-0.5, 0.5), atol=0.051)
    assert region.minimum == (20,)


@pytest.mark.parametrize(
    ('q', 'pose', 'message'),
    [
        (np.zeros((2, 5)), None, r'shape \(2, 5\)'),
        (np.zeros((3, 3, 3, 3)), None, '1 to 3 axes'),
        (np.full((5, 5), np.nan), None, 'not finite'),
        (np.zeros((5, 5)), (0, 2), 'does not lie within the edge'),
        (np.zeros((5, 5)), (2,), 'does not lie within the edge'),
    ],
)
def test_what_is_no_grid_is_refused(q, pose, message):
    with pytest.raises(InvalidConfig, match=message):
        region_on_grid(q, 1.0, pose)


def test_misuse_along_axes_is_refused(rng):
    landscape = Landscape(surface(rng, 20), surface(rng, 20))
    with pytest.raises(InvalidConfig, match='farthest is -1'):
        region_along_axes(landscape, farthest=-1)
    with pytest.raises(InvalidTransform, match='shape'):
        region_along_axes(landscape, np.eye(3))
    with pytest.raises(InvalidConfig, match='all in one place'):
        region_along_axes(Landscape(np.ones((9, 3)), np.ones((9, 3))))
