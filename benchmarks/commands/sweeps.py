"""`python -m benchmarks sweeps`."""

from dataclasses import replace

from benchmarks.commands.outputs import QUICK, add_output_options, check_outputs, write
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import FAILED, OK, UsageError, progress

TRIALS, QUICK_TRIALS, RUNS, SEED = 120, 8, 15, 3000
OWN = ('voxel_size', 'mode', 'assessment', 'motion', 'motion_reference')


def add_parser(kinds):
    """Add the subcommand."""
    parser = kinds.add_parser(
        'sweeps',
        help='sensors that move while they scan; exit code 1 if a figure is missed',
        description='Register simulated sweeps of sensors in motion beside scans of sensors that '
        'stand still, three real sweeps beside their truth, and fast drives beside KISS-ICP '
        '(extra bench; left out where it is not installed). Ten minutes on a core.',
    )
    parser.add_argument(
        '--trials', type=int, metavar='N', help=f'simulated sweeps (default: {TRIALS})'
    )
    add_output_options(parser)
    add_config_options(parser, without=OWN)
    parser.set_defaults(run=_run)


def _run(args):
    from benchmarks.sweeps import cost, newer, odometry, page, pairs

    trials = args.trials or (QUICK_TRIALS if args.quick else TRIALS)
    if trials < len(pairs.SCENES):
        raise UsageError(f'--trials is {trials}; it must be from {len(pairs.SCENES)}')
    given = config_from(args)
    check_outputs(args)

    def config(voxel_size, motion):
        return replace(given, voxel_size=voxel_size, motion=motion, motion_reference='middle')

    runs = 3 if args.quick else RUNS
    found = page.Found(
        pairs.measure(config, trials, progress),
        newer.measure(config),
        odometry.measure(config, SEED, progress),
        cost.undoing_ms(runs),
        *cost.refinement_ms(config, runs),
    )
    goals = page.goals(found)
    text = page.markdown(found, goals, trials)
    text += QUICK.format('few sweeps and few runs') * args.quick
    write(args, page.json_record(found, goals), text)
    print(text)
    return OK if args.quick or all(goal.reached for goal in goals) else FAILED
