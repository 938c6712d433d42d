"""What stands in for the paper's remeshing filter where pymeshlab is missing."""

from importlib.util import find_spec

import numpy as np
import pytest
from scipy.spatial import cKDTree

from idem_ros.experiments.conditions import make_case
from idem_ros.experiments.maps import landscape_of, q_map
from idem_ros.experiments.models import paper_model, relaxed, remeshed, surface_samples
from idem_ros.experiments.table2 import GRIDS

pytestmark = pytest.mark.skipif(find_spec('pymeshlab') is not None, reason='pymeshlab is there')


def apart(points):
    return cKDTree(points).query(points, 2)[0][:, 1]


def test_points_of_another_mesh_lie_on_the_surface_evenly_and_are_no_vertices(rng):
    model = paper_model()
    points, how = remeshed(model, 800, rng)
    samples = surface_samples(model, 200_000, np.random.default_rng(1))
    assert cKDTree(samples).query(points)[0].max() < 0.5  # [mm]
    assert apart(points).std() / apart(points).mean() < 0.2
    assert cKDTree(model.vertices).query(points)[0].min() > 1e-6
    assert 'for want of pymeshlab' in how


def test_relaxed_points_are_more_even(rng):
    samples = np.column_stack([rng.random((50_000, 2)), np.zeros(50_000)])
    points = samples[:300]
    moved = relaxed(points, samples)
    assert apart(moved).std() < 0.8 * apart(points).std()


def test_the_remeshed_part_of_the_bunny_is_found_where_it_is(shared_data):
    path = shared_data / 'stanford_bunny/reconstruction/bun_zipper_res3.ply'
    case = make_case('B0p1-Brp', paper_model(path))
    found = q_map(case, landscape_of(case, 1), GRIDS['mm'].axes, GRIDS['mm'].of_q.offsets(True))
    assert found.error == 0
