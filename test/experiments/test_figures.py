import csv
from itertools import product

import numpy as np
import pytest

from idem_ros.core import q_tot
from idem_ros.experiments import figures_clouds, figures_curves, figures_maps, figures_volumes
from idem_ros.experiments.catalogue import FIGURES
from idem_ros.experiments.conditions import Case, make_case
from idem_ros.experiments.experiment import Context
from idem_ros.experiments.figures_maps import Grid
from idem_ros.experiments.maps import (
    Map,
    landscape_of,
    points_in_common,
    q_map,
    rmse_maps,
    symmetric_range,
)
from idem_ros.experiments.models import paper_model

pytest.importorskip('matplotlib')


@pytest.fixture(scope='module')
def model():
    return paper_model()


@pytest.fixture
def context(tmp_path, model):
    return Context(tmp_path, model, quick=True)


def rows_of(paths):
    with paths[0].open() as stream:
        return list(csv.DictReader(stream))


def require_outputs(paths, name):
    assert [path.name for path in paths] == [
        f'{name}.{end}' for end in ('csv', 'png', 'pdf', 'md')
    ]
    assert all(path.stat().st_size > 200 for path in paths)
    assert f'![{name[:6]} {name[6:]}]({name}.png)' in paths[-1].read_text()


def test_every_figure_of_the_experiments_is_listed_once_in_order():
    assert [each.name for each in FIGURES] == [
        f'figure{number}' for number in (*range(4, 14), 15, 16, 17, 18)
    ]


@pytest.mark.parametrize('figure', figures_curves.FIGURES, ids=lambda f: f'figure{f.number}')
def test_the_curves_are_written_and_perfect_alignment_is_their_minimum(
    context, monkeypatch, figure
):
    monkeypatch.setattr(figures_curves, 'VALUES_OF_A', (1.0, 2.0))
    paths = figures_curves.run(figure._replace(quick_step=10.0), context)
    require_outputs(paths, f'figure{figure.number}')
    rows = rows_of(paths)
    q = np.array([float(row['q_tot_a_1']) for row in rows])
    middle = len(rows) // 2
    unit = 'deg' if figure.axis == 'rz' else 'mm'
    assert float(rows[middle][f'offset_{unit}']) == 0
    assert q[middle] == pytest.approx(0, abs=1e-6)
    assert q[middle - 1] > 1000
    assert q[middle + 1] > 1000
    page = paths[-1].read_text()
    assert '| peak below' in page.replace('  ', ' ')


def test_the_peaks_of_the_curves_are_marked(context):
    figure = figures_curves.FIGURES[0]
    case = make_case('B0-B0', context.model)
    offsets = symmetric_range(12.0, 1.0)
    curve = figures_curves._curve(figure, case, 1.0, offsets, 1)
    np.testing.assert_allclose(offsets[list(curve.peaks)], (-3, 3), atol=1)
    drawn = figures_curves._drawn(figure, offsets, [curve])
    (triangles,) = (line for line in drawn.axes[0].lines if line.get_marker() == 'v')
    np.testing.assert_array_equal(triangles.get_xdata(), offsets[list(curve.peaks)])


@pytest.mark.parametrize('figure', figures_maps.FIGURES, ids=lambda f: f'figure{f.number}')
def test_the_colormaps_are_written_and_q_tot_is_least_at_perfect_alignment(context, figure):
    coarse = tuple(
        row._replace(
            of_q=Grid(row.of_q.reach, 0, row.of_q.reach / 2),
            of_rmse=Grid(row.of_rmse.reach, 0, row.of_rmse.reach),
        )
        for row in figure.rows
    )
    paths = figures_maps.run(figure._replace(rows=coarse), context)
    require_outputs(paths, f'figure{figure.number}')
    rows = rows_of(paths)
    assert len(rows) == (25 + 9 + 9) * len(figure.rows)
    for first in 'ad'[: len(figure.rows)]:
        of_q = [row for row in rows if row['panel'] == first]
        least = min(of_q, key=lambda row: float(row['value']))
        assert (float(least['offset_1']), float(least['offset_2'])) == (0, 0)
        assert {row['inside_roi'] for row in of_q} <= {'0', '1'}
    assert {row['inside_roi'] for row in rows if row['panel'] in 'bcef'} == {''}
    page = paths[-1].read_text()
    assert page.count('The region of interest (white line)') == len(figure.rows)
    assert all(f'{error:g}' in page for error in figure.rows[0].paper)


def test_the_region_of_interest_is_outlined_and_dashed_where_it_is_open(model):
    from idem_ros.experiments.drawing import canvas, draw_map

    case = make_case('B0-B0', model)
    landscape = landscape_of(case)
    for reach, style in ((6.0, 'solid'), (2.0, 'dashed')):
        shown = q_map(case, landscape, ('x', 'y'), symmetric_range(reach, 0.5))
        assert shown.region.closed == (style == 'solid')
        _, axes = canvas(1, 1, 3.0)
        draw_map(axes[0, 0], shown, 'a')
        (outline,) = (c for c in axes[0, 0].collections if hasattr(c, 'get_segments'))
        assert len(outline.get_segments()) >= 4
        (_, dashes), *_ = outline.get_linestyle()
        assert (dashes is None) == (style == 'solid')
        markers = [line.get_marker() for line in axes[0, 0].lines]
        assert markers == ['+', 'o']


@pytest.mark.parametrize('figure', figures_volumes.FIGURES, ids=lambda f: f'figure{f.number}')
def test_the_volumes_are_written_with_their_region(context, monkeypatch, figure):
    monkeypatch.setattr(figures_volumes, 'OF_SHIFTS', (5.0, 2.5, 2.5))
    monkeypatch.setattr(figures_volumes, 'OF_TURNS', (25.0, 12.5, 12.5))
    monkeypatch.setattr(figures_volumes, 'ALL_SHIFTS', (80.0, 20.0, 20.0))
    monkeypatch.setattr(figures_volumes, 'ALL_TURNS', (180.0, 60.0, 60.0))
    paths = figures_volumes.run(figure, context)
    require_outputs(paths, f'figure{figure.number}')
    rows = rows_of(paths)
    flat = 9**2 + 7**2 if figure.number == 6 else 0
    assert len(rows) == flat + 2 * 5**3
    here = [row for row in rows if all(float(row[name]) == 0 for name in 'xyz')]
    assert all(row['inside_roi'] == '1' for row in here if float(row['rx']) == 0
               and float(row['ry']) == 0 and float(row['rz']) == 0)  # fmt: skip
    assert 'Translations: the region of interest has' in paths[-1].read_text()


@pytest.mark.parametrize('figure', figures_clouds.FIGURES, ids=lambda f: f'figure{f.number}')
def test_the_pictures_are_written_with_every_point(context, figure):
    paths = figures_clouds.run(figure, context)
    require_outputs(paths, f'figure{figure.number}')
    counts = {10: 1087 + 1112, 12: 1597 + 968 + 1087 + 967, 17: 34101 + 16101}  # of table 2
    assert len(rows_of(paths)) == counts[figure.number]


def small_case(rng):
    return Case('A-B', 'two small clouds', rng.random((40, 3)), rng.random((30, 3)))


def naive_rmse(of, to):
    return np.sqrt(np.mean([min(np.sum((p - to) ** 2, axis=1)) for p in of]))


def turned(points, rx, ry):
    """Around the mean, about X first and then about Y, written out."""
    around = points - points.mean(axis=0)
    x, y, z = around.T
    y, z = y * np.cos(rx) - z * np.sin(rx), y * np.sin(rx) + z * np.cos(rx)
    x, z = x * np.cos(ry) + z * np.sin(ry), -x * np.sin(ry) + z * np.cos(ry)
    return np.c_[x, y, z] + points.mean(axis=0)


@pytest.mark.parametrize('axes', [('x', 'y'), ('rx', 'ry')])
def test_the_maps_hold_what_each_displacement_gives_alone(rng, axes):
    case = small_case(rng)
    offsets = symmetric_range(20.0, 10.0) if axes[0] == 'rx' else symmetric_range(0.2, 0.1)
    landscape = landscape_of(case, radius=0.4)
    q, (forth, back) = q_map(case, landscape, axes, offsets), rmse_maps(case, axes, offsets)
    for i, j in product(range(5), repeat=2):
        if axes[0] == 'rx':
            moved = turned(case.source, *np.deg2rad(offsets[[i, j]]))
        else:
            moved = case.source + (offsets[i], offsets[j], 0)
        expected = q_tot(case.target, moved, radius=0.4, length_scale='none')
        assert q.values[i, j] == pytest.approx(expected, rel=1e-9)
        assert forth.values[i, j] == pytest.approx(naive_rmse(case.target, moved))
        assert back.values[i, j] == pytest.approx(naive_rmse(moved, case.target))
    assert (q.unit, forth.title, back.title) == (
        'deg' if axes[0] == 'rx' else 'mm',
        'A → B',
        'B → A',
    )


def test_the_points_that_both_clouds_have_are_counted(rng):
    target = rng.random((40, 3))
    source = np.concatenate([target[:7], rng.random((5, 3))])
    sentence = points_in_common(Case('A-B', 'seven in common', target, source))
    assert sentence.startswith("7 of the source's 12 points")


def test_of_equal_minima_the_nearest_counts():
    offsets = symmetric_range(2.0, 1.0)
    values = np.ones((5, 5))
    values[0, 0] = values[2, 3] = 0.0
    found = Map('A → B', 'RMSE [mm]', ('x', 'y'), (offsets, offsets), values, 'mm')
    assert found.minimum == (0, 1)
    assert found.error == 1


def test_the_skin_of_a_cube_has_six_sides():
    from idem_ros.experiments.drawing import skin_of

    inside = np.zeros((5, 5, 5), bool)
    inside[1:4, 1:4, 1:4] = True
    corners, values = skin_of(inside, symmetric_range(2.0, 1.0), inside * 7.0)
    assert corners.shape == (6 * 9, 4, 3)
    assert (values == 7).all()
    assert np.abs(corners).max() == 1.5
    assert (np.abs(corners).max(axis=2) == 1.5).all()


def test_three_planes_cross_in_the_pose():
    from idem_ros.experiments.drawing import planes_in_space

    offsets = symmetric_range(1.0, 1.0)
    corners, values = planes_in_space(offsets, {k: np.full((3, 3), float(k)) for k in range(3)})
    assert corners.shape == (27, 4, 3)
    for normal in range(3):
        assert (corners[values == normal][:, :, normal] == 0).all()
