"""`python -m benchmarks tunnels`."""

from benchmarks.commands.outputs import (
    QUICK,
    add_jobs,
    add_output_options,
    check_jobs,
    check_outputs,
    write,
)
from idem_ros.terminal.command_line import FAILED, OK, UsageError, progress

TRIALS, QUICK_TRIALS = 400, 24
FIRST_SEED = 1000  # those below 100 are what the numbers were chosen on


def add_parser(kinds):
    """Add the subcommand."""
    parser = kinds.add_parser(
        'tunnels',
        help='scenes that hold a motion weakly or not at all; exit code 1 if a figure is missed',
        description='Register simulated scans of tunnels, facades and planes, bare or with '
        'niches or posts, and of ordinary scenes, by LiDARs of 16 to 128 rings, a solid-state '
        'raster and rays at random. Ten minutes on a core.',
    )
    parser.add_argument(
        '--trials',
        type=int,
        metavar='N',
        help=f'of bare scenes, and half as many of either other kind (default: {TRIALS})',
    )
    parser.add_argument(
        '--seed',
        type=int,
        default=FIRST_SEED,
        metavar='N',
        help=f'the first (default: {FIRST_SEED}; the numbers were chosen on those below 100)',
    )
    add_jobs(parser)
    add_output_options(parser)
    parser.set_defaults(run=_run)


def _run(args):
    from benchmarks.tunnels import page
    from benchmarks.tunnels.trials import trial
    from idem_ros.core import warm_up
    from idem_ros.evaluation.worker_processes import worker_pool

    trials = args.trials or (QUICK_TRIALS if args.quick else TRIALS)
    if trials < len(page.BARE):
        raise UsageError(f'--trials is {trials}; it must be from {len(page.BARE)}')
    check_jobs(args)
    check_outputs(args)
    warm_up()
    tasks = page.Counts.of(trials).tasks(args.seed)
    with worker_pool(args.jobs) as pool:
        found = list(progress(pool.map(trial, *zip(*tasks, strict=True)), len(tasks)))
    text = page.markdown(found) + QUICK.format('few trials') * args.quick
    write(args, page.json_record(found), text)
    print(text)
    reached = all(goal.reached for goal in page.goals(found))
    return OK if args.quick or reached else FAILED
