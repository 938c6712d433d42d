"""`idem simulate`: record a simulated drive with exact truth."""

from idem_ros.commands.exit_codes import OK, UsageError

SCANS, MAP_POINTS, SEED = 21, 80_000, 0


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'simulate',
        help='record a simulated drive with exact truth',
        description='Drive a LiDAR through a simulated street and write an MCAP: a map on '
        '/target, scans on /source, guesses that are 1.5 deg and 0.3 m off on /initial_guess, '
        'and the exact poses on /ground_truth. The defaults make bags/demo.mcap.',
    )
    parser.add_argument('--out', metavar='FILE.mcap', required=True, help='recording to write')
    parser.add_argument('--seed', type=int, default=SEED, help='(default: %(default)s)')
    parser.add_argument('--scans', type=int, default=SCANS, help='(default: %(default)s)')
    parser.set_defaults(run=run)


def run(args):
    """Simulate and write."""
    import numpy as np

    from idem_ros.files.atomic_file import require_writable
    from idem_ros.recording.writer import write_mcap
    from idem_ros.simulation.recording import drive_messages
    from idem_ros.simulation.street import street

    if not args.out.endswith('.mcap'):
        raise UsageError(f'--out is {args.out}; its name must end in .mcap')
    if args.seed < 0 or args.scans < 2:
        raise UsageError(
            f'--seed is {args.seed} and --scans {args.scans}; they must be from 0 and from 2'
        )
    require_writable(args.out)
    rng = np.random.default_rng(args.seed)
    write_mcap(args.out, drive_messages(street(rng), args.scans, MAP_POINTS, rng))
    print(f'{args.out}: {args.scans} scans against a map of {MAP_POINTS} points')
    return OK
