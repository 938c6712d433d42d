"""The figure of the experiments in six degrees of freedom: success and errors by case."""

import numpy as np

from idem_ros.experiments.drawing import canvas

LEAST = 1e-4  # errors below are drawn there [deg, r_4th]
COLOURS = {
    'IDEM': '#d62728',
    'IDEM 4r': '#ff9896',
    'ICP': '#7f7f7f',
    'PLANE_ICP': '#1f77b4',
    'GICP': '#2ca02c',
}
MARKS = {'IDEM': 'o', 'IDEM 4r': 'D', 'ICP': 'v', 'PLANE_ICP': 's', 'GICP': '^'}
SPREAD = 0.7  # of the distance between two cases, over which the methods stand


def figure_of(outcomes, methods, title):
    """Return the figure of `Outcome`s: the rate of success, both errors with median and p90."""
    figure, axes = canvas(3, 1, height=6.4, sharex=True)
    rate, rotation, translation = axes[:, 0]
    across = np.arange(len(outcomes))
    for k, method in enumerate(methods):
        x = across + SPREAD * ((k + 0.5) / len(methods) - 0.5)
        figures = [outcome.figures[k] for outcome in outcomes]
        style = {'color': COLOURS[method], 'marker': MARKS[method], 'ls': '', 'ms': 3.5}
        rate.plot(x, [100 * each.success for each in figures], label=method, **style)
        _draw_errors(rotation, x, [each.rotation_deg for each in figures], style)
        relative = [
            {key: each.translation_m[key] / outcome.r_4th for key in ('median', 'p90')}
            for each, outcome in zip(figures, outcomes, strict=True)
        ]
        _draw_errors(translation, x, relative, style)
    _dress(axes[:, 0], outcomes)
    figure.suptitle(f'{title}, in six degrees of freedom', fontsize='large')
    figure.legend(
        *rate.get_legend_handles_labels(), loc='outside lower center', ncols=len(methods)
    )
    return figure


def _draw_errors(axes, x, errors, style):
    """Draw the medians, and a line up from each to the 90th percentile."""
    median, p90 = (np.maximum([each[key] for each in errors], LEAST) for key in ('median', 'p90'))
    axes.plot(x, median, **style)
    axes.vlines(x, median, p90, color=style['color'], lw=1.0)


def _dress(axes, outcomes):
    rate, rotation, translation = axes
    rate.set(ylabel='success [%]', ylim=(-5, 105))
    for panel, label, limit in (
        (rotation, 'rotation error [deg]', 1.0),
        (translation, 'translation error [r_4th]', 0.5),
    ):
        panel.set(yscale='log', ylabel=f'{label}\nmedian, line to p90')
        panel.axhline(limit, color='black', lw=0.8, ls='--')
        panel.annotate(
            'success below',
            (0.995, limit),
            xycoords=('axes fraction', 'data'),
            xytext=(0, 2),
            textcoords='offset points',
            ha='right',
            fontsize='small',
        )
    for panel in axes:
        panel.grid(axis='y', alpha=0.3)
        for k in range(1, len(outcomes), 2):
            panel.axvspan(k - 0.5, k + 0.5, color='black', alpha=0.04, lw=0)
    translation.set_xlim(-0.5, len(outcomes) - 0.5)
    names = [outcome.name for outcome in outcomes]
    translation.set_xticks(range(len(names)), names, rotation=45, ha='right')
