"""Figures 4 to 18 of the paper, by the labels in its source, as experiments."""

from functools import partial

from idem_ros.experiments import figures_clouds, figures_curves, figures_maps, figures_volumes
from idem_ros.experiments.experiment import Experiment


def _curves(figure):
    what = 'around Z' if figure.axis == 'rz' else 'along X'
    return f'q_tot {what} for several values of a'


def _volumes(figure):
    return f'q_tot of {figure.case} over planes and volumes, with the region of interest'


def _maps(figure):
    return f'Colormaps of q_tot and RMSE of {figure.case}'


def _clouds(figure):
    return f'The clouds of {" and ".join(figure.cases)} as pictures'


_KINDS = (
    (figures_curves, _curves),
    (figures_volumes, _volumes),
    (figures_maps, _maps),
    (figures_clouds, _clouds),
)

FIGURES = tuple(
    Experiment(
        f'figure{figure.number}',
        f'{title_of(figure)} (figure {figure.number})',
        partial(kind.run, figure),
    )
    for figure, kind, title_of in sorted(
        ((figure, kind, title_of) for kind, title_of in _KINDS for figure in kind.FIGURES),
        key=lambda each: each[0].number,
    )
)
