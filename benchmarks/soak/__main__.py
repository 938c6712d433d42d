"""Hold the node to a robot's working day: `python -m benchmarks.soak`, or `make soak`."""

import argparse
import os
import signal
import sys
from dataclasses import replace

from idem_ros.core.exceptions import IdemError
from idem_ros.node.environment import loopback_environment

OK, MISSED = 0, 1


def main(argv: list[str] | None = None) -> int:
    """Run the parts, print each figure; return 1 where one is not reached."""
    parser = argparse.ArgumentParser(
        'python -m benchmarks.soak',
        description='Start the node and a player as processes of their own on this machine only, '
        'stream large clouds at the pace of a robot for ten minutes, larger ones at twice that '
        'pace, sweeps of a fast drive, clouds at five times the pace, kill the node and start it '
        'again; some 14 minutes. Prints each '
        'figure as reached or MISSED; exit code 1 where one is missed.',
    )
    parser.add_argument(
        '--quick',
        action='store_true',
        help='small clouds for seconds; times are printed, not judged',
    )
    parser.add_argument(
        '--only',
        metavar='PART',
        help='long_run, fast_run, moving_run, overload or killed (default: these), or kept: '
        'a capsule of every source, beside none; or flood: an hour of guesses, garbage, a clock '
        'that jumps and a second node of the same name',
    )
    parser.add_argument(
        '--kills', type=int, help='how often the node is killed (default: 10); 200 take 15 minutes'
    )
    parser.add_argument('--seconds', type=float, help='how long the flood lasts (default: 3600)')
    args = parser.parse_args(argv)
    for signum in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, _end)  # an exception, so that the processes end with their blocks
    os.environ.update(loopback_environment())
    try:
        return _soak(args)
    except ImportError as error:
        print(f'soak: error: {error}: install the extras ros and bench', file=sys.stderr)
    except IdemError as error:
        print(f'soak: error: {error}', file=sys.stderr)
    return MISSED


def _soak(args: argparse.Namespace) -> int:
    from benchmarks.goal import goals_table
    from benchmarks.soak.children import SoakFailed
    from benchmarks.soak.flood import flood
    from benchmarks.soak.parts import PARTS, QUICK, Size, kept

    size, goals = QUICK if args.quick else Size(), []
    if args.kills is not None:
        size = replace(size, kills=args.kills)
    if args.seconds is not None:
        size = replace(size, flood_s=args.seconds)
    parts = {**PARTS, 'kept': kept, 'flood': flood}
    if args.only not in (None, *parts):
        raise SoakFailed(f'--only {args.only}: there is no such part; {", ".join(parts)}')
    for run in PARTS.values() if args.only is None else (parts[args.only],):
        part = run(size)
        goals += part.goals
        lines = [f'## {part.title}', '', *(f'- {note}' for note in part.notes)]
        print('\n'.join([*lines, '', goals_table(part.goals)]), flush=True)
    missed = [goal.figure for goal in goals if not goal.reached]
    print(f'{len(goals) - len(missed)} of {len(goals)} figures reached')
    return MISSED if missed else OK


def _end(signum, frame):
    raise SystemExit(128 + signum)


if __name__ == '__main__':
    sys.exit(main())
