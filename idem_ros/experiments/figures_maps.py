"""Figures 7, 8, 9, 11, 13, 15 and 18: colormaps of q_tot and of RMSE, one condition each."""

from typing import NamedTuple

from idem_ros.experiments.conditions import make_case
from idem_ros.experiments.drawing import canvas, draw_map, legend_of_marks, title_of
from idem_ros.experiments.experiment import figure_page, write_outputs
from idem_ros.experiments.maps import (
    MAP_HEADER,
    landscape_of,
    points_in_common,
    q_map,
    rmse_maps,
    symmetric_range,
)
from idem_ros.terminal.markdown import table

XY, TURNS = ('x', 'y'), ('rx', 'ry')


class Grid(NamedTuple):
    """Offsets of both axes: from -reach to reach [the case's unit, or degrees]."""

    reach: float
    step: float
    quick_step: float

    def offsets(self, quick):
        """Return them as an array."""
        return symmetric_range(self.reach, self.quick_step if quick else self.step)


class Row(NamedTuple):
    """Three panels: q_tot, RMSE target to source, RMSE source to target; and the paper's errors.

    An error of the paper is a number in the unit of the offsets, or words where it gives none.
    """

    axes: tuple
    of_q: Grid
    of_rmse: Grid
    paper: tuple


class Colormaps(NamedTuple):
    """A figure of the paper: which pair, what its panels span, what it is said to show."""

    number: int
    printed: int
    case: str
    rows: tuple
    shows: str


IN_ROI = Grid(5.0, 0.25, 0.5)
WIDE = Grid(25.0, 0.25, 1.0)
FIGURES = (
    Colormaps(
        7,
        7,
        'B0-B0.1',
        (Row(XY, IN_ROI, IN_ROI, (0, 0.36, 0)),),
        'Density: B0 with a tenth of its points. q_tot is least at perfect alignment, in the '
        'middle of a ring of maxima; RMSE from the dense to the sparse cloud is not.',
    ),
    Colormaps(
        8,
        8,
        'B0-Bn0.25',
        (Row(XY, IN_ROI, IN_ROI, (0, 0, 0.71)),),
        'Noise: a quarter more points, anywhere in the bounding box. q_tot, and RMSE from the '
        'clean cloud, are least at perfect alignment; RMSE from the noisy one is not.',
    ),
    Colormaps(
        9,
        9,
        'B0-Bh25',
        (Row(XY, IN_ROI, IN_ROI, (0, 0.90, 0)),),
        'Holes: 25 points taken away at each of 30 seeds. RMSE from the whole cloud errs.',
    ),
    Colormaps(
        11,
        11,
        'B0p1-B0p2',
        (
            Row(XY, IN_ROI, WIDE, (0, 8.31, 8.28)),
            Row(TURNS, Grid(30.0, 0.25, 1.5), Grid(90.0, 2.0, 6.0), (0, 'distant', 'distant')),
        ),
        'Partial overlap: two ends of B0. q_tot is least at perfect alignment within a ring of '
        'maxima, for translations and for rotations around the centroid; RMSE is least far away.',
    ),
    Colormaps(
        13,
        13,
        'B0-B0r',
        (Row(XY, IN_ROI, IN_ROI, (0, 0.25, 0.35)),),
        'Similar clouds: B0 and the vertices of its remeshed surface. RMSE errs both ways.',
    ),
    Colormaps(
        15,
        14,
        'B0p1-Brp',
        (Row(XY, IN_ROI, WIDE, (0, 15.21, 10.20)),),
        'Similar clouds that overlap partially: the crown of q_tot is lower and less round, but '
        'still there; RMSE is least 10 to 15 mm away.',
    ),
    Colormaps(
        18,
        17,
        'S1-S2',
        (Row(XY, Grid(0.1, 0.005, 0.02), Grid(10.0, 0.5, 2.5), (0, 6.40, 7.28)),),
        'LiDAR stairs, partially overlapping: q_tot within 0.1 m, RMSE within 10 m.',
    ),
)


def run(figure, context):
    """Write one of `FIGURES`; see `Experiment`."""
    case = make_case(figure.case, context.model, context.seed)
    landscape = landscape_of(case, context.threads)
    shown = []
    for row in context.progress(figure.rows, desc=f'figure{figure.number}'):
        shown.append(q_map(case, landscape, row.axes, row.of_q.offsets(context.quick)))
        offsets = row.of_rmse.offsets(context.quick)
        shown.extend(rmse_maps(case, row.axes, offsets, context.threads))
    stem = context.out / f'figure{figure.number}'
    lettered = list(zip('abcdef', shown, strict=False))
    rows = [row for letter, one in lettered for row in one.rows(letter)]
    page = _page(figure, context, case, landscape, lettered)
    return write_outputs(stem, MAP_HEADER, rows, _drawn(figure, lettered), page)


def _drawn(figure, lettered):
    drawn, axes = canvas(len(figure.rows), 3, 0.5 + 3.0 * len(figure.rows))
    drawn.suptitle(f'Figure {figure.number}: q_tot and RMSE of {_names(figure.case)}')
    for place, (letter, shown) in zip(axes.flat, lettered, strict=True):
        draw_map(place, shown, letter)
    legend_of_marks(drawn)
    return drawn


def _names(case):
    return case.replace('-', ' and ')


def _page(figure, context, case, landscape, lettered):
    papers = [error for row in figure.rows for error in row.paper]
    header = ('panel', 'value', 'error, paper', 'error, here', 'minimum at', 'step')
    cells = [_cells(letter, one, of) for (letter, one), of in zip(lettered, papers, strict=True)]
    return figure_page(
        figure,
        f'{title_of(figure)}: {case.name}',
        context.model.note if case.unit == 'mm' else f'The scan is simulated: {case.description}.',
        f'{case.description}: {len(case.target)} and {len(case.source)} points, a = 1, '
        f'radius {landscape.radius:.3g} {case.unit}, lengths in {case.unit} (q_tot is not free '
        f'of units). {points_in_common(case)} The source is moved; the error is how far the '
        "minimum lies from perfect alignment. The paper's picture is not part of its source: its "
        'numbers stand beside ours.',
        table(header, cells, left=2),
        _verdict(lettered, papers),
        *(_of_region(letter, one) for letter, one in lettered if one.region is not None),
    )


def _cells(letter, shown, paper):
    said = paper if isinstance(paper, str) else f'{paper:g} {shown.unit}'
    u, v = shown.minimum
    at = f'({u:.3g}, {v:.3g})'
    step = f'{shown.coordinates[0][1] - shown.coordinates[0][0]:.3g} {shown.unit}'
    what = f'{shown.label.split(" [")[0]}, {shown.title}'
    return f'({letter})', what, said, f'{shown.error:.3g} {shown.unit}', at, step


def _verdict(lettered, papers):
    """Say whether the errors that are zero are the paper's."""
    here = [shown.error > 0 for _, shown in lettered]
    differ = [
        f'({letter})'
        for (letter, _), ours, paper in zip(lettered, here, papers, strict=True)
        if ours != (paper != 0)
    ]
    if not differ:
        return 'The errors that are zero are those of the paper, and no others.'
    return (
        f'Which errors are zero is not as in the paper in {", ".join(differ)}. The clouds are not '
        "the paper's own: the model, the random draws and the crops differ, and the step limits "
        'what can be seen.'
    )


def _of_region(letter, shown):
    region = shown.region
    found = (
        f'({letter}) The region of interest (white line) covers {region.measure:.3g} '
        f'{shown.unit}²; the crown around it is {region.lowest_pass:.4g} nat at its lowest, '
        f'q_IDEM (Eq. 14) is {region.q_idem:.4g} nat.'
    )
    if region.closed:
        return f'{found}\n'
    return f'{found} It reaches the edge of the map (dashed): the area is a lower bound.\n'
