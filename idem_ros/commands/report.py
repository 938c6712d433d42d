"""`idem report`: results of replays as one page that opens without a network."""

from functools import partial

from idem_ros.commands.inputs import (
    add_recordings_under,
    add_results,
    refuse_files_named_twice,
)
from idem_ros.commands.output_names import require_matplotlib
from idem_ros.terminal.command_line import OK, progress

DESCRIPTION = """\
Write a report on one RESULT or several, side by side, into the new folder DIR:

  report.html   one page, complete in itself: summary, errors and q_tot over time,
                distribution and cumulative plots, before against after, times, and
                the ten worst frames with both clouds in 3D and q_tot around
                the result; tables to download as CSV
  *.png, *.csv  the same pictures and tables as files

Without ground truth it shows q_tot before and after, the overlap and how smooth
the trajectory is. The recordings that the results name are read again for the
pictures; where one is not found (as it was named, or beside its result), the page
says so and shows the numbers. Nothing that exists is overwritten.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'report',
        help='results as one HTML page with plots and the worst frames',
        description=DESCRIPTION,
        epilog='example: idem report result.json --out report',
    )
    add_results(parser)
    parser.add_argument('--out', metavar='DIR', required=True, help='folder to make')
    add_recordings_under(parser)
    parser.set_defaults(run=run)


def run(args):
    """Check, write, say where the page is."""
    refuse_files_named_twice(args.results)
    require_matplotlib('the plots')
    from idem_ros.report.folder import write_report

    page = write_report(
        args.results, args.out, partial(progress, unit='frame'), args.recordings_under
    )
    print(f'{page}: {page.stat().st_size / 1e6:.1f} MB')
    return OK
