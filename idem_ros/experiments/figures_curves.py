"""Figures 4 and 5: q_tot of B_0 with itself along X and around Z, for several values of a."""

from typing import NamedTuple

import numpy as np

from idem_ros.core import search_radius
from idem_ros.core.metric.landscape import q_on_grid
from idem_ros.core.metric.region_of_interest import nearest_maximum
from idem_ros.experiments.conditions import make_case
from idem_ros.experiments.drawing import axis_label, canvas
from idem_ros.experiments.experiment import figure_page, write_outputs
from idem_ros.experiments.maps import landscape_of, symmetric_range
from idem_ros.terminal.markdown import table

# The paper names a < 1, a = 1 and a wider than the cloud; the others are read off no list.
VALUES_OF_A = (0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 32.0)
CASE = 'B0-B0'


class Curves(NamedTuple):
    """A figure of the paper: along or around which axis, how far, and what it shows."""

    number: int
    axis: str
    step: float
    quick_step: float
    shows: str


class Curve(NamedTuple):
    """q_tot at the offsets of a figure, for one value of a."""

    a: float
    radius: float
    q: np.ndarray  # (n,)
    peaks: tuple  # indices of the nearest maxima below and above 0; None: there is none


FIGURES = (
    Curves(
        4,
        'x',
        1.0,
        2.0,
        'q_tot is 0 in perfect overlap and where the clouds are apart, for every a. The curve of '
        'a = 1 has the highest peaks. For larger a the peaks fall at first and rise again later, '
        'and move apart; for smaller a they fade.',
    ),
    Curves(
        5,
        'rz',
        1.0,
        5.0,
        'Rotations from -180 to 180 degrees: the minimum is perfect alignment for every a, and '
        'a = 1 has the highest curve.',
    ),
)


def run(figure, context):
    """Write one of `FIGURES`; see `Experiment`."""
    case = make_case(CASE, context.model, context.seed)
    step = figure.quick_step if context.quick else figure.step
    offsets = symmetric_range(_reach(figure, case), step)
    steps = context.progress(VALUES_OF_A, desc=f'figure{figure.number}')
    curves = [_curve(figure, case, a, offsets, context.threads) for a in steps]
    stem = context.out / f'figure{figure.number}'
    header = (f'offset_{_unit(figure)}', *(f'q_tot_a_{curve.a:g}' for curve in curves))
    rows = [
        (f'{offset:g}', *(f'{q:.8g}' for q in values))
        for offset, values in zip(offsets, np.array([c.q for c in curves]).T, strict=True)
    ]
    page = _page(figure, context, offsets, curves)
    return write_outputs(stem, header, rows, _drawn(figure, offsets, curves), page)


def _reach(figure, case):
    """Along X until the clouds are apart at a = 16; around Z half a turn."""
    if figure.axis == 'rz':
        return 180.0
    apart = np.ptp(case.target[:, 0]) + 16 * search_radius(case.target, case.source)
    return float(np.ceil(apart / 10) * 10)


def _unit(figure):
    return 'deg' if figure.axis == 'rz' else 'mm'


def _curve(figure, case, a, offsets, threads):
    radius = search_radius(case.target, case.source, a)
    in_own_unit = np.deg2rad(offsets) if figure.axis == 'rz' else offsets
    landscape = landscape_of(case, threads, radius)
    q = q_on_grid(landscape, **{figure.axis: in_own_unit})
    middle = len(q) // 2
    below, above = nearest_maximum(q[middle::-1]), nearest_maximum(q[middle:])
    peaks = (
        None if below is None else middle - below,
        None if above is None else middle + above,
    )
    return Curve(a, radius, q, peaks)


def _drawn(figure, offsets, curves):
    from matplotlib import colormaps

    drawn, ((axes,),) = canvas(1, 1, 4.0)
    for k, curve in enumerate(curves):
        colour = 'black' if curve.a == 1 else colormaps['turbo'](0.05 + 0.9 * k / len(curves))
        width = 2.0 if curve.a == 1 else 1.1
        label = f'a = {curve.a:g}'
        axes.plot(offsets, curve.q, color=colour, lw=width, label=label)
        peaks = [peak for peak in curve.peaks if peak is not None]
        axes.plot(offsets[peaks], curve.q[peaks], 'v', color=colour, ms=5)
    what = 'turning about Z' if figure.axis == 'rz' else 'moving along X'
    axes.set(
        title=f'Figure {figure.number}: q_tot of B0 with itself, {what} (triangles: peaks)',
        xlabel=axis_label(figure.axis, _unit(figure)),
        ylabel='q_tot [nat]',
        xlim=(offsets[0], offsets[-1]),
    )
    axes.axvline(0, color='gray', lw=0.6, ls=':')
    axes.grid(alpha=0.3)
    axes.legend(ncols=1, loc='center left', bbox_to_anchor=(1.0, 0.5))
    return drawn


def _page(figure, context, offsets, curves):
    unit = _unit(figure)
    best = max(curves, key=lambda curve: curve.q.max())
    at_zero = max(abs(curve.q[len(offsets) // 2]) for curve in curves)
    header = ('a', 'radius [mm]', 'highest q_tot [nat]', f'peak below [{unit}]', 'peak above')
    return figure_page(
        figure,
        f'Figure {figure.number}: q_tot along one axis, as a varies',
        context.model.note,
        f'The highest curve is that of a = {best.a:g}; at perfect alignment q_tot is '
        f'{at_zero:.1g} nat or less for every a. Steps of {offsets[1] - offsets[0]:g} {unit}, '
        "lengths in mm. The paper's values of a are in its picture only, which is not part of its "
        'source: ours are a choice. A peak is the nearest maximum on a side; a dash where q_tot '
        'falls nowhere after its rise.',
        table(header, [_cells(curve, offsets) for curve in curves], left=0),
    )


def _cells(curve, offsets):
    peaks = ('-' if peak is None else f'{offsets[peak]:g}' for peak in curve.peaks)
    return f'{curve.a:g}', f'{curve.radius:.3g}', f'{curve.q.max():.5g}', *peaks
