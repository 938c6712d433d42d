"""Every experiment by name, and the run that goes on where an earlier one was interrupted."""

import json
from functools import partial

from idem_ros.core.exceptions import IdemError
from idem_ros.experiments import (
    figures_clouds,
    figures_curves,
    figures_maps,
    figures_volumes,
    table1,
    table2,
)
from idem_ros.experiments.experiment import Experiment, settings_of
from idem_ros.files.atomic_file import replacing
from idem_ros.files.structured_text import parse_json


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

# To add one: write `run(context)` in a module of this folder and add its record here.
EXPERIMENTS = (
    Experiment('table1', 'Sensitivity to Gaussian noise (table 1, figure 19)', table1.run),
    Experiment('table2', 'The error of every metric in 20 cases (table 2)', table2.run),
    *FIGURES,
)


class UnknownExperiment(IdemError):
    """A name that no experiment bears."""


def chosen_experiments(names):
    """Return the experiments of these names, in the catalogue's order; 'all' is every one.

    Raises:
        UnknownExperiment: naming those that exist.
    """
    known = [experiment.name for experiment in EXPERIMENTS]
    unknown = [name for name in names if name not in (*known, 'all')]
    if unknown:
        raise UnknownExperiment(
            f'there is no experiment {unknown[0]!r}; there are {", ".join(known)}, and all'
        )
    return [each for each in EXPERIMENTS if each.name in names or 'all' in names]


def run_or_keep(experiment, context):
    """Run an experiment unless its outputs are there, of the same settings.

    A run that ends leaves NAME.done.json: its settings and its files.

    Returns:
        (paths, ran): the outputs, and whether they were made now.
    """
    stamp = context.out / f'{experiment.name}.done.json'
    settings = {'experiment': experiment.name, **settings_of(context)}
    files = _files_of(stamp, settings)
    if files and all((context.out / name).is_file() for name in files):
        return [context.out / name for name in files], False
    stamp.unlink(missing_ok=True)  # its files are about to be replaced
    paths = experiment.run(context)
    record = {**settings, 'files': [path.name for path in paths]}
    with replacing(stamp) as temporary:
        temporary.write_text(json.dumps(record, indent=1) + '\n')
    return paths, True


def _files_of(stamp, settings):
    """Return the names of the files that a stamp of these settings lists, else none."""
    try:
        record = parse_json(stamp.read_bytes())
        files = record.pop('files')
        is_ours = record == settings and all(isinstance(name, str) for name in files)
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return []
    return files if is_ours else []
