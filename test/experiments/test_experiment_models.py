import numpy as np
import pytest

from idem_ros.core import fourth_neighbor_distance
from idem_ros.experiments.conditions import case_names, make_case
from idem_ros.experiments.models import POINTS, R_4TH, UnusableModel, paper_model
from idem_ros.files.cloud_file import UnreadableCloud


def test_the_stand_in_has_the_papers_size_and_spacing_and_says_that_it_stands_in():
    model = paper_model()
    assert len(model.points) == POINTS
    assert fourth_neighbor_distance(model.points) == pytest.approx(R_4TH)
    assert 'not public' in model.note
    assert "project's own making" in model.note


def test_its_mesh_is_closed_and_looks_outward():
    model = paper_model()
    edges = np.sort(model.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 2).all()
    a, b, c = (model.vertices[model.faces[:, k]] for k in range(3))
    assert np.einsum('ij,ij->', np.cross(b, c), a) > 0


def test_a_seed_gives_the_same_model_and_another_another():
    np.testing.assert_array_equal(paper_model(seed=1).points, paper_model(seed=1).points)
    assert not np.array_equal(paper_model(seed=1).points, paper_model(seed=2).points)


def test_the_bunny_takes_the_papers_place(shared_data):
    folder = shared_data / 'stanford_bunny' / 'reconstruction'
    model = paper_model(folder / 'bun_zipper_res3.ply')
    assert (model.name, len(model.points)) == ('bun_zipper_res3', POINTS)
    with pytest.raises(UnusableModel, match='453 usable vertices'):
        paper_model(folder / 'bun_zipper_res4.ply')


def test_a_model_that_cannot_be_used_is_refused_by_name(tmp_path):
    few, same, empty = (tmp_path / f'{name}.xyz' for name in ('few', 'same', 'empty'))
    np.savetxt(few, np.eye(3))
    np.savetxt(same, np.ones((2000, 3)))
    empty.write_text('')
    with pytest.raises(UnusableModel, match='few.xyz has 3 usable vertices'):
        paper_model(few)
    with pytest.raises(UnusableModel, match='on top of one another'):
        paper_model(same)
    with pytest.raises(UnreadableCloud, match='empty.xyz'):
        paper_model(empty)


def test_holes_and_choices_are_parts_of_the_model_and_noise_is_added():
    model = paper_model()
    assert len(case_names()) == 20
    whole = {tuple(p) for p in model.points}
    for name in ('B0-B0.5', 'B0-Bh25'):
        assert {tuple(p) for p in make_case(name, model).source} < whole
    assert {tuple(p) for p in make_case('B0-Bn0.25', model).source} > whole
