"""The plots of a report: each one measure, all runs in it, before against after."""

from dataclasses import dataclass

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from idem_ros.report.runs import MEASURES
from idem_ros.viewer.page import STYLE, save

COLOURS = ('#1f6fb4', '#d1495b', '#2e8b57', '#8e5ea2', '#b5720a', '#17919c', '#5c5c5c', '#a0336e')
BEFORE = {'ls': (0, (2, 1.5)), 'lw': 1.0, 'alpha': 0.65}
AFTER = {'ls': '-', 'lw': 1.2}
WIDTH, HEIGHT, LEGEND_LINE = 4.1, 2.7, 0.19  # [in]; a phone's page is as wide
BINS = 30
TICKS = 5
MARGIN = 0.04
NARROW, WIDE = 4.0, 30.0  # greatest over least: no logarithm below, ticks at decades only above
MOST_SHOWN = 26  # letters of a name in a legend
FEW = 60  # frames that are marked one by one


@dataclass(frozen=True)
class Plot:
    """A finished picture."""

    stem: str
    """Of its file name."""
    title: str
    measure: str
    """What it is of; plots of the same belong together."""
    svg: bytes
    png: bytes


def plots(runs):
    """Yield a `Plot` of each view of each measure that any frame holds."""
    for measure in MEASURES:
        known = [
            np.isfinite(run.values(name)).any()
            for run in runs
            for name in (measure.name, measure.before)
        ]
        if any(known):
            with_before = any(known[1::2])
            for view, draw in VIEWS.items():
                if with_before or view != 'before_after':
                    yield _plot(runs, measure, view, draw, with_before)


def shown(name):
    """Return a name as a legend can hold it: short, and without what matplotlib would parse."""
    printable = ''.join(letter if letter.isprintable() else '?' for letter in name)
    if len(printable) > MOST_SHOWN:
        printable = f'{printable[: MOST_SHOWN // 2]}…{printable[-MOST_SHOWN // 2 + 1 :]}'
    return printable.replace('$', r'\$')


def _plot(runs, measure, view, draw, with_before):
    lines = -(-len(runs) // 2) * (len(runs) > 1) + with_before
    with rc_context(STYLE):
        figure = Figure((WIDTH, HEIGHT + LEGEND_LINE * lines), layout='constrained')
        axes = figure.subplots()
        axes.grid(alpha=0.25, lw=0.6)
        draw(axes, runs, measure)
        _add_legend(figure, runs, with_before and view != 'before_after')
        title = TITLES[view].format(measure.title)
        return Plot(f'{measure.name}_{view}', title, measure.title, *save(figure))


def _over_time(axes, runs, measure):
    series = list(_series(runs, measure))
    for run, colour, values, style in series:
        marked = {'marker': '.', 'ms': 4} if len(values) <= FEW else {}
        axes.plot(run.seconds, values, color=colour, **style, **marked)
    axes.set(xlabel='time [s]', ylabel=measure.label)
    axes.xaxis.set_major_locator(MaxNLocator(TICKS))
    _scale(axes, 'y', _values(series), measure.log)


def _distribution(axes, runs, measure):
    series = list(_series(runs, measure))
    log = _scale(axes, 'x', _values(series), measure.log)
    low, high = axes.get_xlim()
    edges = (np.geomspace if log else np.linspace)(low, high, BINS + 1)
    for _, colour, values, style in series:
        axes.hist(values[np.isfinite(values)], edges, histtype='step', color=colour, **style)
    axes.set(xlabel=measure.label, ylabel='frames')
    axes.yaxis.set_major_locator(MaxNLocator(TICKS, integer=True))


def _cumulative(axes, runs, measure):
    series = list(_series(runs, measure))
    for _, colour, values, style in series:
        known = np.sort(values[np.isfinite(values)])
        share = np.arange(1, known.size + 1) / known.size * 100
        axes.step(known, share, where='post', color=colour, **style)
    axes.set(xlabel=measure.label, ylabel='frames at most so [%]', ylim=(0, 102))
    _scale(axes, 'x', _values(series), measure.log)


def _before_after(axes, runs, measure):
    pairs = [(run.values(measure.before), run.values(measure.name)) for run in runs]
    for (before, after), colour in zip(pairs, _colours(runs), strict=True):
        axes.plot(before, after, '.', ms=4, alpha=0.6, color=colour)
    axes.set(xlabel=f'before [{measure.unit}]', ylabel=f'after [{measure.unit}]')
    both = np.concatenate([values for pair in pairs for values in pair])
    for axis in ('x', 'y'):
        _scale(axes, axis, both, measure.log)
    limits = min(axes.get_xlim()[0], axes.get_ylim()[0]), axes.get_xlim()[1]
    axes.plot(limits, limits, color='#777777', lw=0.8, scalex=False, scaley=False)


VIEWS = {
    'over_time': _over_time,
    'distribution': _distribution,
    'cumulative': _cumulative,
    'before_after': _before_after,
}
TITLES = {
    'over_time': '{} over time',
    'distribution': '{}: distribution',
    'cumulative': '{}: cumulative',
    'before_after': '{}: before against after',
}


def _series(runs, measure):
    """Yield (run, colour, values, style) of what is known: at the guess, then refined."""
    for run, colour in zip(runs, _colours(runs), strict=True):
        for name, style in ((measure.before, BEFORE), (measure.name, AFTER)):
            values = run.values(name)
            if np.isfinite(values).any():
                yield run, colour, values, style


def _colours(runs):
    return [COLOURS[i % len(COLOURS)] for i in range(len(runs))]


def _add_legend(figure, runs, with_before):
    entries = []
    if len(runs) > 1:
        names = [shown(run.name) for run in runs]
        entries = [
            Line2D([], [], color=colour, label=name, lw=2)
            for colour, name in zip(_colours(runs), names, strict=True)
        ]
    if with_before:
        entries += [
            Line2D([], [], color='#444444', label=label, **style)
            for label, style in (('before (guess)', BEFORE), ('after (refined)', AFTER))
        ]
    if entries:
        figure.legend(handles=entries, loc='outside upper left', ncols=2, frameon=False)


def _values(series):
    return np.concatenate([values for *_, values, _ in series])


def _scale(axes, which, values, log):
    """Set limits, ticks and scale of an axis; return whether it became logarithmic.

    Ticks are few, and their labels short: nothing may overlap on a phone. Zeros and what is below
    have no place on a logarithmic axis.
    """
    finite = values[np.isfinite(values)]
    positive = finite[finite > 0]
    log = log and bool(positive.size) and positive.max() > NARROW * positive.min()
    known = positive if log else finite
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    axis = getattr(axes, f'{which}axis')
    set_limits = getattr(axes, f'set_{which}lim')
    if log:
        getattr(axes, f'set_{which}scale')('log')
        subs = (1.0, 2.0, 5.0) if high < WIDE * low else (1.0,)
        axis.set_major_locator(LogLocator(subs=subs, numticks=TICKS))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f'{value:g}'))
        axis.set_minor_formatter(NullFormatter())
        margin = (high / low) ** MARGIN
        set_limits(low / margin, high * margin)
        return True
    margin = MARGIN * (high - low)
    if margin <= 1e-9 * abs(high):  # all the same: a tenth around it
        margin = 0.1 * abs(high) or 1.0
    axis.set_major_locator(MaxNLocator(TICKS))
    set_limits(low - margin, high + margin)
    return False
