"""`idem compare`: two results of the same recording, frame against frame."""

from idem_ros.terminal.command_line import OK
from idem_ros.terminal.printable import printable

DESCRIPTION = """\
Compare two files of `idem replay --json` of the same recording: replayed with other
parameters, by another version. For each measure, over the frames that both have
(sources of the same stamp), the median of B less A with its 95 % confidence
interval, and whether B is

  better, worse   the whole interval is below or above zero
  cannot tell     zero is in it, or fewer than six frames have the measure

Below, what became of all sources of each: frames, refused, dropped, without a
partner, and the verdicts; medians do not show what was lost.

Settings and versions that the two were made with and that differ are listed before:
an audit, which moves nothing, or odometry, which has no map, is another task.

Less is better in all of the measures. The interval is that of the sign test: exact, whatever
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
    from idem_ros.results.comparison import MEASURES, differing_settings
    from idem_ros.terminal.markdown import number, table

    lines = [
        printable(f'A: {a.path}, of {a.bag}'),
        printable(f'B: {b.path}, of {b.bag}'),
        f'{comparison.shared} frames in both, {comparison.only_a} only in A, '
        f'{comparison.only_b} only in B',
        '',
    ]
    if otherwise := differing_settings(a, b):
        lines.append(table(['made with', 'A', 'B'], otherwise, left=3))
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
    tables = table(header, rows), table(['sources', 'A', 'B', 'B - A'], _tallies(a, b))
    return '\n'.join([*lines, '\n'.join(tables).rstrip()])


def _tallies(a, b):
    """Return a row for each thing that became of sources: what medians do not show."""
    from idem_ros.results.comparison import tally

    of_a, of_b = tally(a), tally(b)
    counts = {name: (of_a.get(name, 0), of_b.get(name, 0)) for name in {**of_a, **of_b}}
    return [(name, *map(str, each), f'{each[1] - each[0]:+d}') for name, each in counts.items()]


def _json(a, b, comparison):
    import json
    from dataclasses import asdict

    from idem_ros.results.comparison import differing_settings, tally

    record = {
        **{name: {'path': r.path, 'bag': r.bag} for name, r in (('a', a), ('b', b))},
        'settings': {name: {'a': x, 'b': y} for name, x, y in differing_settings(a, b)},
        'sources': {'a': tally(a), 'b': tally(b)},
        'frames': {name: getattr(comparison, name) for name in ('shared', 'only_a', 'only_b')},
        'differences': [{**asdict(d), 'verdict': d.verdict.value} for d in comparison.differences],
    }
    return json.dumps(record, indent=1, allow_nan=False)
