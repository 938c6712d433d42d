"""`idem trajectory`: the errors of an estimated trajectory by the field's definitions."""

import re

from idem_ros.terminal.command_line import OK, UsageError

DELTA = re.compile(r'([0-9]*\.?[0-9]+)\s*([mf])\s*')
DESCRIPTION = """\
Compare the trajectory ESTIMATE with the true one, REFERENCE, and print

  APE    absolute pose error: where each pose is, against where it should be
  RPE    relative pose error: the motion over a number of frames or a distance
         against the true one; shows drift, whatever came before
  KITTI  drift over segments of 100 to 800 m, in percent and degrees per 100 m

with evo's definitions and names (evo_ape and evo_rpe give the same numbers; RPE's
pairs are consecutive, and distances are along the estimate's path, as there).

Files: TUM lines `t x y z qx qy qz qw` (`idem replay --tum` writes them), a .csv
with the header stamp,x,y,z,qx,qy,qz,qw, or KITTI's twelve numbers a line, which
have no stamps: then both files must have as many poses.
"""
EPILOG = """\
examples:
  idem trajectory truth.tum result.tum
  idem trajectory truth.tum result.tum --align --delta 10f --delta 5m --json
  idem trajectory poses/07.txt result.txt --lengths 10 20 50
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'trajectory',
        help='errors of a trajectory: APE, RPE and KITTI',
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument('reference', metavar='REFERENCE', help='the true trajectory')
    parser.add_argument('estimate', metavar='ESTIMATE', help='the trajectory to judge')
    parser.add_argument(
        '--align',
        action='store_true',
        help='first move the estimate as a whole onto the reference (Umeyama, no scale)',
    )
    parser.add_argument(
        '--delta',
        metavar='N',
        nargs='+',
        action='extend',
        help='of an RPE: metres as 5m, or frames as 10f; may be several (default: 1f 1m)',
    )
    parser.add_argument(
        '--all-pairs',
        action='store_true',
        help='an RPE pair begins at each pose, not where the one before ends',
    )
    parser.add_argument(
        '--lengths', metavar='M', nargs='+', type=float, help="of KITTI's segments [m]"
    )
    parser.add_argument(
        '--tolerance',
        metavar='S',
        type=float,
        default=0.01,
        help='between stamps that belong together [s] (default: %(default)s)',
    )
    parser.add_argument('--json', action='store_true', help='print the numbers as JSON')
    parser.set_defaults(run=run)


def run(args):
    """Read both, compare, print."""
    from idem_ros.files.trajectory_file import read_trajectory
    from idem_ros.trajectory import comparison_table as trajectory_report

    deltas = _deltas(args.delta) if args.delta else trajectory_report.DELTAS
    lengths = args.lengths or trajectory_report.LENGTHS
    for option, numbers in (('--lengths', lengths), ('--tolerance', [args.tolerance])):
        if not all(0 < value < float('inf') for value in numbers):
            raise UsageError(f'{option} is {" ".join(map(str, numbers))}; it must be positive')
    record = trajectory_report.compared(
        read_trajectory(args.reference),
        read_trajectory(args.estimate),
        align=args.align,
        deltas=deltas,
        all_pairs=args.all_pairs,
        lengths=lengths,
        tolerance=args.tolerance,
    )
    print(_json(args, record) if args.json else trajectory_report.report(record))
    return OK


def _deltas(words):
    """Return (number, unit) of each delta; `1 m` is read like `1m`."""
    text = ' '.join(words)
    if not re.fullmatch(f'({DELTA.pattern})+', text):
        raise UsageError(f'--delta is {text}; it must be metres as 5m, or frames as 10f')
    deltas = []
    for digits, unit in DELTA.findall(text):
        number = float(digits)
        if number <= 0 or (unit == 'f' and number % 1):
            raise UsageError(f'--delta is {digits}{unit}; it must be positive, and frames whole')
        deltas.append((int(number) if unit == 'f' else number, unit))
    return deltas


def _json(args, record):
    import json

    named = {'reference': args.reference, 'estimate': args.estimate, **record}
    return json.dumps(named, indent=1, allow_nan=False)
