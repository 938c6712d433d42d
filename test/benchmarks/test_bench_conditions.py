import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks.conditions import CONDITIONS, POINTS, condition
from idem_ros.core.geometry import se3
from idem_ros.simulation.body import remeshed_points, surface_points


@pytest.fixture(scope='module')
def cases():
    """{name: case} of every condition."""
    return {name: condition(name, 0) for name in CONDITIONS}


def placed(case):
    return case.target, se3.transform_points(case.truth, case.source)


def within(points, others, distance):
    """The share of points that have one of the others this near."""
    return np.mean(cKDTree(others).query(points)[0] < distance)


def test_points_are_as_likely_anywhere_on_the_surface(rng):
    points = surface_points(rng, 6000)
    fine = surface_points(rng, 6000)
    count = cKDTree(fine).query_ball_point(points, 0.008, return_length=True)
    plain = count[np.linalg.norm(points, axis=1) < 0.06]
    tips = count[
        np.linalg.norm(points, axis=1) > np.quantile(np.linalg.norm(points, axis=1), 0.98)
    ]
    assert np.median(tips) > 0.5 * np.median(plain)


def test_a_remeshed_model_has_points_at_even_distances(rng):
    points = remeshed_points(rng, 500)
    nearest = cKDTree(points).query(points, 2)[0][:, 1]
    assert len(points) == pytest.approx(500, rel=0.2)
    assert nearest.min() > 0.6 * nearest.mean()


@pytest.mark.parametrize('name', CONDITIONS)
def test_both_clouds_are_independent_samplings_of_one_surface(cases, name):
    case = cases[name]
    target, source = placed(case)
    assert within(source, target, 1e-9) == 0.0
    assert within(source, target, 2.0 * case.spacing) > 0.25
    assert not np.allclose(case.truth, np.eye(4))


def test_conditions_are_what_their_names_say(cases):
    sizes = {name: (len(case.target), len(case.source)) for name, case in cases.items()}
    assert sizes['density 10:1'] == (POINTS, POINTS // 10)
    assert sizes['noise 25 %'] == (1.25 * POINTS, 1.25 * POINTS)
    assert 0.45 * POINTS < sizes['holes'][0] < 0.6 * POINTS
    assert sizes['similar'][1] == pytest.approx(0.6 * POINTS, rel=0.2)
    for share in (0.5, 0.3):
        target, source = placed(cases[f'overlap {100 * share:g} %'])
        assert within(source, target, 0.004) == pytest.approx(share, abs=0.06)


def test_the_same_seed_gives_the_same_clouds_and_another_seed_others(cases):
    again, other = condition('holes', 0), condition('holes', 1)
    assert np.array_equal(cases['holes'].source, again.source)
    assert not np.array_equal(cases['holes'].target[:100], other.target[:100])
