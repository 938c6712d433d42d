"""What an experiment is, what it is given, and how its outputs are written: complete or not."""

import csv
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from idem_ros.experiments.models import Model
from idem_ros.files.atomic_file import replacing
from idem_ros.terminal.printable import cell

DPI = 200


@dataclass(frozen=True)
class Context:
    """What an experiment runs with.

    Attributes:
        out: existing folder of the outputs.
        model: in place of the paper's B_0.
        seed: of everything that is drawn.
        quick: coarse grids and few trials, for a look within minutes.
        progress: as tqdm: wraps an iterable; takes `total` and `desc`.
        threads: for what can use more than one.
    """

    out: Path
    model: Model
    seed: int = 0
    quick: bool = False
    progress: Callable = lambda steps, **_: steps
    threads: int = 1


@dataclass(frozen=True)
class Experiment:
    """A table or figure of the paper.

    Attributes:
        name: one word, the stem of its files.
        title: a line for `idem experiments list`.
        run: takes the `Context`, writes NAME.csv, NAME.png, NAME.pdf, NAME.md (as far as it has
            them) into `context.out` by the functions below and returns their paths.
    """

    name: str
    title: str
    run: Callable[[Context], list[Path]]


def settings_of(context):
    """Return what the outputs of a `Context` depend on, as JSON holds it."""
    model = hashlib.sha256(context.model.points.tobytes())
    model.update(context.model.faces.tobytes())
    return {
        'seed': context.seed,
        'quick': context.quick,
        'model': f'{context.model.name} {model.hexdigest()[:16]}',
    }


def write_csv(path, header, rows):
    """Write a table of numbers and words; return the path."""
    with replacing(path) as temporary, temporary.open('w', newline='') as stream:
        writer = csv.writer(stream, lineterminator='\n')
        writer.writerows(map(cell, row) for row in [header, *rows])
    return Path(path)


def write_page(path, text):
    """Write a page of Markdown; return the path."""
    with replacing(path) as temporary:
        temporary.write_text(text.rstrip() + '\n')
    return Path(path)


def write_figure(stem, figure):
    """Write a matplotlib figure as stem.png and stem.pdf, close it, and return both paths."""
    from matplotlib import pyplot as plt

    paths = [Path(f'{stem}{suffix}') for suffix in ('.png', '.pdf')]
    for path in paths:
        # Without a date the same figure is the same file.
        metadata = {'CreationDate': None} if path.suffix == '.pdf' else None
        with replacing(path) as temporary:
            figure.savefig(temporary, dpi=DPI, bbox_inches='tight', metadata=metadata)
        figure.set_layout_engine('none')  # it is laid out now, which takes as long as to draw it
    plt.close(figure)
    return paths


def write_outputs(stem, header, rows, figure, page):
    """Write stem.csv, stem.png, stem.pdf and stem.md; return their paths."""
    written = [write_csv(f'{stem}.csv', header, rows), *write_figure(stem, figure)]
    return [*written, write_page(f'{stem}.md', page)]


def figure_page(figure, title, note, here, *parts):
    """Return the Markdown of a figure: what the paper shows of it, and what there is here."""
    shown = [f'# {title}', note, f'**The paper shows.** {figure.shows}', f'**Here.** {here}']
    shown += [part.rstrip() for part in parts]
    return '\n\n'.join([*shown, f'![figure {figure.number}](figure{figure.number}.png)'])
