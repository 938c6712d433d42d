"""Reports on results: one page that opens without a network, its pictures and CSV files beside."""

import re
from itertools import groupby
from pathlib import Path

from idem_ros.files.atomic_file import filling, require_free
from idem_ros.report import tables, worst_frames
from idem_ros.report.plots import COLOURS, plots
from idem_ros.report.runs import read_runs
from idem_ros.viewer.page import SCRIPTS, environment, policy, text_of

PAGE = 'report.html'
MOST_OF_NAME = 60  # letters
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


def write_report(results, folder, progress=lambda steps, total: steps, under=None):
    """Write a report on results into a new folder.

    Recordings that the results name are read again for the pictures of the worst frames; where
    one is not found, the page says so.

    Args:
        results: files, as `read_result` takes them; several are shown side by side.
        folder: to be made; it appears complete or not at all.
        progress: wraps the iteration over the `total` worst frames to show how far it is.
        under: the folder that recordings must lie in to be read; None: anywhere.

    Returns:
        The `Path` of the page.

    Raises:
        UnwritableFile: the folder is not empty or cannot be written.
        UnreadableResult: one of the results cannot be read.
    """
    require_free(folder)
    runs = read_runs(results)
    ordered = [worst_frames.worst(run) for run in runs]
    pictures = worst_frames.draw(runs, [order for order, _ in ordered], progress, under)
    worst = [
        (tables.worst(run, order), sentence, [pictures[number, int(i)] for i in order])
        for number, (run, (order, sentence)) in enumerate(zip(runs, ordered, strict=True))
    ]
    drawn = list(plots(runs))
    tables_as_files = _csv_files(runs, worst)
    with filling(folder) as temporary:
        whole = {PAGE: _encoded(page(runs, drawn, worst, tables_as_files))}
        images = _images(runs, drawn, pictures)
        for name, content in {**tables_as_files, **whole, **images}.items():
            (temporary / name).write_bytes(content)
    return Path(folder) / PAGE


def _csv_files(runs, worst):
    """Return {file name: bytes} of all that can be downloaded."""
    contents = {
        'outcomes.csv': tables.outcomes(runs),
        'verdicts.csv': tables.verdicts(runs),
        'before_and_after.csv': tables.before_and_after(runs),
        'every_number.csv': tables.every_number(runs),
        'settings.csv': tables.parameters(runs),
    }
    for number, (run, (table, _, _)) in enumerate(zip(runs, worst, strict=True)):
        stem = _stem(runs, number)
        contents[f'frames_{stem}.csv'] = tables.frames(run)
        contents[f'worst_{stem}.csv'] = table
    return {name: _encoded(tables.csv_text(table)) for name, table in contents.items()}


def _encoded(text):
    return text.encode(errors='backslashreplace')  # names of files need not be UTF-8


def _images(runs, drawn, pictures):
    images = {f'{plot.stem}.png': plot.png for plot in drawn}
    for (number, i), of_frame in pictures.items():
        for key, image in of_frame.images.items():
            images[f'worst_{_stem(runs, number)}_{i}_{key}.png'] = image
    return images


def _stem(runs, number):
    """Return what tells the files of a run from those of the others, as any file may be named."""
    name = re.sub(r'[^A-Za-z0-9._-]+', '_', runs[number].name)[-MOST_OF_NAME:]
    return name if len(runs) == 1 else f'{number + 1}_{name}'


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
    settings = tables.parameters(runs)
    return _template().render(
        policy=policy(scripts),
        scripts=scripts,
        has_views=has_views,
        style=text_of('report/report.css') + text_of('viewer/viewer.css'),
        runs=runs,
        colours=COLOURS,
        tables=tables,
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
