"""Figures 10, 12 and 17: the clouds that overlap partially, or are remeshed, as pictures."""

from typing import NamedTuple

import numpy as np

from idem_ros.experiments.conditions import make_case
from idem_ros.experiments.drawing import SOURCE, TARGET, canvas, title_of
from idem_ros.experiments.experiment import figure_page, write_outputs
from idem_ros.experiments.maps import points_in_common

HEADER = ('panel', 'cloud', 'x', 'y', 'z')
SHIFT = 25.0  # [mm] along X, of figure 10
FRONT, ABOVE, ALONG = (0, 1), (0, 1), (0, 2)  # axes drawn: the model stands along Y


class Pictures(NamedTuple):
    """A figure of the paper: which pairs of clouds, and what it shows."""

    number: int
    printed: int
    cases: tuple
    shows: str


FIGURES = (
    Pictures(
        10,
        10,
        ('B0p1-B0p2',),
        'B0p1 in green and B0p2 in magenta, and displacements of B0p2 along X.',
    ),
    Pictures(
        12,
        12,
        ('B0-B0r', 'B0p1-Brp'),
        '(a) B0 (green) and the remeshed B0r (magenta). (b) B0p1 and the remeshed part Brp.',
    ),
    Pictures(
        17,
        16,
        ('S1-S2',),
        'The LiDAR scan of a staircase: the scan in colours, and S1 (magenta) and S2 (green).',
    ),
)


def run(figure, context):
    """Write one of `FIGURES`; see `Experiment`."""
    steps = context.progress(figure.cases, desc=f'figure{figure.number}')
    cases = [make_case(name, context.model, context.seed) for name in steps]
    stem = context.out / f'figure{figure.number}'
    rows = [
        (panel, name, *(f'{c:.6g}' for c in point))
        for panel, case in zip('ab', cases, strict=False)
        for name, points in zip(case.name.split('-'), (case.target, case.source), strict=True)
        for point in points.tolist()
    ]
    drawn = {10: _displaced, 12: _remeshed, 17: _scene}[figure.number](*cases)
    return write_outputs(stem, HEADER, rows, drawn, _page(figure, context, cases))


def _displaced(case):
    """The source aligned, and moved along X to either side."""
    drawn, axes = canvas(1, 3, 2.6, sharex=True, sharey=True)
    for place, letter, shift in zip(axes.flat, 'abc', (-SHIFT, 0.0, SHIFT), strict=True):
        _draw_pair(place, case, FRONT, shift)
        where = f'moved by {shift:g} mm' if shift else 'aligned'
        place.set_title(f'({letter}) {case.name.split("-")[1]} {where}')
        place.label_outer()
    drawn.suptitle('Figure 10: B0p1 and B0p2 from the front')
    _legend(drawn, axes[0, 0])
    return drawn


def _remeshed(*cases):
    drawn, axes = canvas(1, 2, 4.1, sharex=True, sharey=True)
    for place, letter, case in zip(axes.flat, 'ab', cases, strict=True):
        _draw_pair(place, case, FRONT)
        place.set_title(f'({letter}) {case.name.replace("-", " and ")}')
        below = {'loc': 'upper center', 'bbox_to_anchor': (0.5, -0.14), 'ncols': 2}
        place.legend(markerscale=3, frameon=False, **below)
        place.label_outer()
    drawn.suptitle('Figure 12: B0 and its remeshed surface, whole and in part, from the front')
    return drawn


def _scene(case):
    """The whole coloured by height; then both parts by colour, from above and from the front."""
    drawn, axes = canvas(3, 1, 9.4)
    points = np.concatenate([case.target, case.source])
    points = points[np.argsort(points[:, 2])]  # what is higher is drawn over what is lower
    seen = axes[0, 0].scatter(*points[:, ABOVE].T, c=points[:, 2], s=0.5, lw=0, cmap='viridis')
    seen.set_rasterized(True)
    drawn.colorbar(seen, ax=axes[0, 0], label='height [m]', location='bottom', aspect=60)
    _dress(axes[0, 0], ABOVE, 'm', '(a) both parts from above, coloured by height')
    # The paper has S1 in magenta and S2 in green.
    for place, seen_axes in ((axes[1, 0], ABOVE), (axes[2, 0], ALONG)):
        _draw_pair(place, case, seen_axes, size=0.5, colours=(SOURCE, TARGET))
    axes[1, 0].set_title('(b) S1 and S2 from above')
    axes[2, 0].set_title('(c) S1 and S2 from the front')
    drawn.suptitle('Figure 17: the simulated scan of a staircase, S1 and S2')
    _legend(drawn, axes[1, 0])
    return drawn


def _draw_pair(place, case, seen, shift=0.0, size=3.0, colours=(TARGET, SOURCE)):
    moved = case.source + (shift, 0.0, 0.0)
    names = case.name.split('-')
    for points, colour, name in zip((case.target, moved), colours, names, strict=True):
        label = f'{name}: {len(points)} points'
        dots = place.scatter(*points[:, seen].T, s=size, lw=0, color=colour, label=label)
        dots.set_rasterized(True)
    _dress(place, seen, case.unit, '')


def _dress(place, seen, unit, title):
    across, up = ('XYZ'[k] for k in seen)
    place.set(xlabel=f'{across} [{unit}]', ylabel=f'{up} [{unit}]', title=title, aspect='equal')


def _legend(drawn, place):
    handles, labels = place.get_legend_handles_labels()
    size = 5.0 / np.sqrt(handles[0].get_sizes()[0])
    legend = {'loc': 'outside lower center', 'ncols': 2, 'frameon': False}
    drawn.legend(handles, labels, markerscale=size, **legend)


def _page(figure, context, cases):
    of_model = cases[0].unit == 'mm'
    return figure_page(
        figure,
        f'{title_of(figure)}: the clouds',
        context.model.note if of_model else "The scan is simulated: the paper's is not public.",
        "The paper's picture is not part of its source, and so not beside ours.",
        '\n'.join(
            f'- {case.name}: {len(case.target)} and {len(case.source)} points; '
            f'{case.description}. {points_in_common(case)}'
            for case in cases
        ),
    )
