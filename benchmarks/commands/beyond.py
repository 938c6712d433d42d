"""What goes beyond the paper, made as its tables are: with the options of `idem experiments`."""

from functools import partial
from importlib import import_module

from idem_ros.commands.experiments import add_run_options, run_each

BEYOND = {
    'six_dof': ('table 2 in six degrees of freedom', 'benchmarks.six_dof.pages', 'run'),
    'six_dof_independent': (
        'the same of two independent samplings',
        'benchmarks.six_dof.pages',
        'run_independent',
    ),
    'verdict': ('the models that judge results, trained again', 'benchmarks.trust.train', 'run'),
}


def add_parsers(kinds):
    """Add the subcommands."""
    for name, (title, *_) in BEYOND.items():
        parser = kinds.add_parser(name, help=title)
        add_run_options(parser)
        parser.set_defaults(run=partial(_run, name))


def _run(name, args):
    from idem_ros.experiments.experiment import Experiment

    title, module, function = BEYOND[name]
    run = getattr(import_module(module), function)
    return run_each([Experiment(name, title, run)], args)
