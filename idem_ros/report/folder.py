"""Reports on results: one page that opens without a network, its pictures and CSV files beside."""

import re
from pathlib import Path

from idem_ros.files.atomic_file import filling, require_free
from idem_ros.report import tables, worst_frames
from idem_ros.report.page import page
from idem_ros.report.plots import plots
from idem_ros.report.runs import read_runs

PAGE = 'report.html'
MOST_OF_NAME = 60  # letters


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
