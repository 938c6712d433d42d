"""The page of a report: one HTML file that holds all it shows and asks no network for anything."""

from itertools import groupby

from idem_ros.report import tables as report_tables
from idem_ros.report.plots import COLOURS
from idem_ros.viewer.page import SCRIPTS, environment, policy, text_of

MISSING = '–'
LONG = 48  # letters of a cell from which on it is cut, and told in full on hovering
CAPTIONS = {
    'q_tot': 'slice of q_tot around the result: a valley at the circle is what is sought',
}
READING = {
    'before, after': 'at the initial guess and at the refined pose.',
    'translation and rotation error': 'distance and angle to the ground truth; left out where the '
    'recording has none.',
    'q_tot': 'the local entropy of both clouds together minus that of each [nat]: the less, the '
    'better they agree. It depends on the number of points, so compare a frame with itself.',
    'q_mean': 'q_tot per point that has a neighbour in the other cloud; may be compared between '
    'frames.',
    'overlap': 'share of the points that have a neighbour in the other cloud; in a map that is '
    'much larger than the scan, of the points of the scan.',
    'verdict, reason': 'whether the pose can be trusted, and what speaks against it.',
    'sigma': 'the largest standard deviation of the position and of the rotation, of the '
    'covariance of the pose; left out where nothing is known of it.',
    'basin': 'where the guess was: 0 at the minimum, 1 at the rim of the basin that leads to it.',
    'position and rotation, 2nd difference': 'how far each pose is from where its neighbours in '
    'time would have it, twice; with evenly spaced stamps the second difference of the '
    'trajectory. It is 0 for a steady motion; a single high value is a jump, of the vehicle or '
    'of the registration, and no error by itself. It says something where the target stays, as '
    'a map does.',
    'time': 'of reading the messages and registering.',
    'cumulative': 'the share of the frames whose number is at most that on the axis.',
    'before against after': 'a point a frame; below the line the refinement has lowered it.',
}


def page(runs, plots, worst, downloads):
    """Return the page.

    Args:
        runs: [`Run`].
        plots: [`Plot`], those of one measure in a row.
        worst: for each run (`Table` of its worst frames, sentence on their order, [`Pictures`]).
        downloads: {file name: bytes of CSV}.
    """
    has_views = any(each.view for *_, pictures in worst for each in pictures)
    names = (*(SCRIPTS if has_views else ()), 'report/report.js')
    scripts = [text_of(name) for name in names]
    settings = report_tables.parameters(runs)
    return _template().render(
        policy=policy(scripts),
        scripts=scripts,
        has_views=has_views,
        style=text_of('report/report.css') + text_of('viewer/viewer.css'),
        runs=runs,
        colours=COLOURS,
        tables=report_tables,
        notes=[
            f'{run.name}: {note}' for run in runs for note in run.result.record.get('notes', ())
        ],
        settings=settings,
        differing={row for row in settings.rows if len(set(row[1:])) > 1},
        plots=[(name, list(group)) for name, group in groupby(plots, lambda plot: plot.measure)],
        worst=list(zip(runs, worst, strict=True)),
        captions=CAPTIONS,
        downloads=downloads,
        reading=READING,
        longest_cell=LONG,
    )


def _template():
    made = environment()
    made.filters |= {'cell': _cell, 'numeric_columns': _numeric_columns}
    return made.get_template('report/report.html.jinja')


def _numeric_columns(table):
    """Return for each column whether any of its cells is a number."""
    return [
        any(isinstance(row[k], int | float) for row in table.rows)
        for k in range(len(table.header))
    ]


def _cell(value):
    if value is None:
        return MISSING
    return f'{value:.4g}' if isinstance(value, float) else str(value)
