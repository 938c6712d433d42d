"""`idem compare`: two results of the same recording, frame against frame."""

import argparse

from idem_ros.commands.exit_codes import OK
from idem_ros.terminal.printable import printable

DESCRIPTION = """\
Compare two files of `idem replay --json` of the same recording: replayed with other
parameters, by another version. For each measure, over the frames that both have
(sources of the same stamp), the median of B less A with its 95 % confidence
interval, and whether B is

  better, worse   the whole interval is below or above zero
  cannot tell     zero is in it, or fewer than six frames have the measure

Less is better in all of them. The interval is that of the sign test: exact, whatever
the distribution, if frames are independent. q_tot compares within one radius and one
length_scale only: frames of another radius are left out of it. A significant
difference may be too small to matter: look at its size, too.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'compare',
        help='is result B better than A, worse, or who knows',
        description=DESCRIPTION,
        epilog='example: idem compare before.json after.json',
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('a', metavar='A', help='what `idem replay` wrote: JSON or MCAP')
    parser.add_argument('b', metavar='B', help='the same, to be judged against A')
    parser.add_argument('--json', action='store_true', help='print the comparison as JSON')
    parser.set_defaults(run=run)


def run(args):
    """Read both, compare, print."""
    from idem_ros.results.comparison import compare
    from idem_ros.results.result_file import read_result

    a, b = read_result(args.a), read_result(args.b)
    comparison = compare(a, b)
    print(_json(a, b, comparison) if args.json else _text(a, b, comparison))
    return OK


def _text(a, b, comparison):
    from idem_ros.results.comparison import MEASURES
    from idem_ros.terminal.markdown import number, table

    lines = [
        printable(f'A: {a.path}, of {a.bag}'),
        printable(f'B: {b.path}, of {b.bag}'),
        f'{comparison.shared} frames in both, {comparison.only_a} only in A, '
        f'{comparison.only_b} only in B',
        '',
    ]
    rows = [
        (
            MEASURES[d.measure],
            *map(number, (d.median_a, d.median_b, d.median)),
            '-' if d.low is None else f'{d.low:.3g} .. {d.high:.3g}',
            d.frames,
            d.verdict.value + (f' ({d.note})' if d.note else ''),
        )
        for d in comparison.differences
    ]
    header = ['median of', 'A', 'B', 'B - A', '95 % interval', 'frames', 'B is']
    return '\n'.join(lines) + '\n' + table(header, rows).rstrip()


def _json(a, b, comparison):
    import json
    from dataclasses import asdict

    record = {
        **{name: {'path': r.path, 'bag': r.bag} for name, r in (('a', a), ('b', b))},
        'frames': {name: getattr(comparison, name) for name in ('shared', 'only_a', 'only_b')},
        'differences': [{**asdict(d), 'verdict': d.verdict.value} for d in comparison.differences],
    }
    return json.dumps(record, indent=1, allow_nan=False)
