"""`idem show`: one frame of a result as a page, both clouds in 3D."""

from pathlib import Path

from idem_ros.commands.inputs import RESULT, add_recordings_under
from idem_ros.commands.output_names import (
    require_ending,
    require_matplotlib,
    require_outputs,
    require_rerun,
)
from idem_ros.terminal.command_line import OK, UsageError

DESCRIPTION = """\
Write one HTML page on one frame of RESULT: both clouds in 3D, coloured by cloud or by
what each point adds to q_tot, at the guess and refined; the motions that nothing
determines; q_tot along each axis with the guess, the result and the crests around it;
and the numbers that the verdict stands on. The page opens without a network.
--rerun writes the clouds, the steps and the verdict for rerun's viewer instead, or too.

The recording that RESULT names is read again, and the frame registered again from its
guess, with the parameters of then.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'show',
        help='one frame of a result as a page, both clouds in 3D',
        description=DESCRIPTION,
        epilog='example: idem show result.json --out page.html',
    )
    parser.add_argument('result', metavar='RESULT', help=RESULT)
    parser.add_argument(
        '--frame', type=int, metavar='N', help='its number, from 0 (default: the worst)'
    )
    parser.add_argument('--out', metavar='FILE.html', help='page to write')
    parser.add_argument(
        '--rerun', metavar='FILE.rrd', help='recording of rerun to write (extra "view")'
    )
    add_recordings_under(parser)
    parser.set_defaults(run=run)


def run(args):
    """Check, register again, write, say where it is."""
    writers = {}
    if args.out:
        require_ending('--out', args.out, ['.html', '.htm'])
        require_matplotlib('the pictures')
        writers[args.out] = _write_page
    if args.rerun:
        require_ending('--rerun', args.rerun, ['.rrd'])
        require_rerun()
        writers[args.rerun] = _write_rerun
    if not writers:
        raise UsageError('nothing to write; name a page with --out, or a recording with --rerun')
    from idem_ros.files.atomic_file import replacing
    from idem_ros.report.worst_frames import shown_frame

    require_outputs(args, [('--out', args.out), ('--rerun', args.rerun)], [args.result])
    scene = shown_frame(args.result, args.frame, args.recordings_under)
    for file, write in writers.items():
        with replacing(file) as temporary:
            write(temporary, scene)
        print(f'{file}: {Path(file).stat().st_size / 1e6:.1f} MB')
    return OK


def _write_page(path, scene):
    from idem_ros.viewer.page import page

    path.write_text(page(scene), encoding='utf-8')


def _write_rerun(path, scene):
    from idem_ros.viewer.rerun_file import write_rerun

    write_rerun(path, scene)
