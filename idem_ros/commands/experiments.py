"""`idem experiments`: the tables and figures of the paper, made again."""

import os
from pathlib import Path

from idem_ros.commands.output_names import require_matplotlib
from idem_ros.terminal.command_line import OK, UsageError, progress

OUT = 'experiments'


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'experiments',
        help="make the paper's tables and figures again",
        description="Make the paper's tables and figures again, each beside the paper's own.",
    )
    kinds = parser.add_subparsers(title='commands', metavar='COMMAND')
    listing = kinds.add_parser('list', help='list what there is')
    listing.set_defaults(run=_list)
    running = kinds.add_parser(
        'run',
        help='run some, or all',
        description='Run experiments. Each writes CSV, PNG, PDF and a Markdown page. What an '
        'earlier run made with the same settings is kept: an interrupted run goes on.',
    )
    running.add_argument('names', nargs='+', metavar='NAME', help='of the list, or all')
    add_run_options(running)
    running.set_defaults(run=_run)


def add_run_options(parser):
    """Add what each run of experiments takes, as `run_each` reads it."""
    parser.add_argument(
        '--out', metavar='DIR', default=OUT, help='folder of the outputs (default: %(default)s)'
    )
    parser.add_argument('--seed', type=int, default=0, metavar='N', help='(default: 0)')
    parser.add_argument('--quick', action='store_true', help='coarse grids and few trials')
    parser.add_argument(
        '--model',
        metavar='FILE',
        help="mesh in place of the paper's, such as bun_zipper_res3.ply "
        "(default: a bunny-like surface of the project's own)",
    )


def _list(args):
    from idem_ros.experiments.catalogue import EXPERIMENTS

    width = max(len(experiment.name) for experiment in EXPERIMENTS)
    for experiment in EXPERIMENTS:
        print(f'{experiment.name:{width}}  {experiment.title}')
    return OK


def _run(args):
    from idem_ros.experiments.catalogue import UnknownExperiment, chosen_experiments

    try:
        chosen = chosen_experiments(args.names)
    except UnknownExperiment as error:
        raise UsageError(str(error)) from error
    return run_each(chosen, args)


def run_each(experiments, args):
    """Run `Experiment`s, or keep what an earlier run of the same settings made; say which."""
    from time import perf_counter

    from idem_ros.experiments.catalogue import run_or_keep

    context = _context(args)
    for experiment in experiments:
        start = perf_counter()
        paths, ran = run_or_keep(experiment, context)
        how = f'{perf_counter() - start:.0f} s' if ran else 'kept from an earlier run'
        print(f'{experiment.name}: {", ".join(map(str, paths))} ({how})', flush=True)
    return OK


def _context(args):
    """Refuse, before the work, what could not be used or written after it."""
    from idem_ros.experiments.experiment import Context
    from idem_ros.experiments.models import paper_model
    from idem_ros.files.atomic_file import require_writable

    if args.seed < 0:
        raise UsageError(f'--seed is {args.seed}; it must be from 0')
    require_matplotlib('the figures', 'experiments')
    model = paper_model(args.model, args.seed)
    out = Path(args.out)
    if out.exists() and not out.is_dir():
        raise UsageError(f'--out is {out}, which is no folder')
    out.mkdir(parents=True, exist_ok=True)
    require_writable(out / 'table2.csv')
    return Context(out, model, args.seed, args.quick, progress, os.cpu_count() or 1)
