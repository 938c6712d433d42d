"""Hold the node to a robot's working day: `python -m idem_ros.node.soak`, or `make soak`."""

import argparse
import os
import signal
import sys

from idem_ros.core.exceptions import IdemError
from idem_ros.node.loopback import loopback_environment

OK, MISSED = 0, 1


def main(argv: list[str] | None = None) -> int:
    """Run the parts, print each figure; return 1 where one is not reached."""
    parser = argparse.ArgumentParser(
        'python -m idem_ros.node.soak',
        description='Start the node and a player as processes of their own on this machine only, '
        'stream large clouds at the pace of a robot for ten minutes and at five times that pace, '
        'kill the node and start it again; some 12 minutes. Prints each figure as reached or '
        'MISSED; exit code 1 where one is missed.',
    )
    parser.add_argument(
        '--quick',
        action='store_true',
        help='small clouds for seconds; times are printed, not judged',
    )
    args = parser.parse_args(argv)
    for signum in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, _end)  # an exception, so that the processes end with their blocks
    os.environ.update(loopback_environment())
    try:
        return _soak(args.quick)
    except ImportError as error:
        print(f'soak: error: {error}: install the extras ros and bench', file=sys.stderr)
    except IdemError as error:
        print(f'soak: error: {error}', file=sys.stderr)
    return MISSED


def _soak(is_quick: bool) -> int:
    from idem_ros.benchmarks.goal import goals_table
    from idem_ros.node.soak.parts import QUICK, Size, killed, long_run, overload

    size, goals = QUICK if is_quick else Size(), []
    for run in (long_run, overload, killed):
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
