"""`idem bag`: make a recording out of cloud files."""

from pathlib import Path

from idem_ros.commands.inputs import CLOUD_KINDS, add_columns_option
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.commands.output_names import (
    require_ending,
    require_outputs,
)
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.terminal.command_line import OK, UsageError, progress

KITTI_COLUMNS = 4  # x y z intensity, in every sequence
DESCRIPTION = """\
Write an MCAP with /target, /source, /initial_guess and /ground_truth, and no /tf,
for `idem replay` and `idem play`. Either from files,

  idem bag TARGET SOURCE... [--guess FILE...] [--truth FILE...] --out run.mcap

with TARGET once and each SOURCE with its guess and truth; or from a folder of scans,

  idem bag FOLDER [--trajectory FILE] [--start velocity|identity] --out run.mcap

with each scan registered to the one before. FOLDER is a KITTI odometry sequence
(velodyne/*.bin, calib.txt, and poses.txt; for sequences/07 also ../../poses/07.txt),
whose poses are brought from the camera to the LiDAR: T = Tr^-1 Pi^-1 Pj Tr. With
--trajectory it holds cloud files whose names end in their number, one for each pose
of the sensor in the trajectory (TUM lines; or CSV or KITTI's twelve numbers), whose
stamps they take. Without stamps, scans are 0.1 s apart.

Where a column of a file holds the times of its points they are kept, as the field
time, in seconds after the stamp.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'bag',
        help='make a recording out of cloud files or folders',
        description=DESCRIPTION,
        usage='idem bag [-h] TARGET|FOLDER [SOURCE ...] [options] --out FILE.mcap',
    )
    parser.add_argument(
        'target', metavar='TARGET|FOLDER', help=f'cloud file ({CLOUD_KINDS}) or folder'
    )
    parser.add_argument('sources', metavar='SOURCE', nargs='*', help='cloud files')
    pose = 'pose of each SOURCE in the frame of TARGET: a 4x4 or 3x4 matrix or one TUM line'
    parser.add_argument('--guess', metavar='FILE', nargs='+', default=[], help=f'initial {pose}')
    parser.add_argument('--truth', metavar='FILE', nargs='+', default=[], help=f'true {pose}')
    parser.add_argument('--trajectory', metavar='FILE', help='poses of the scans in FOLDER')
    parser.add_argument(
        '--start',
        choices=('velocity', 'identity'),
        help='guesses of a FOLDER: the true motion of the pair before, the identity for the '
        'first (velocity, the default), or always the identity',
    )
    add_columns_option(parser)
    add_config_options(parser, config_type=PointTimeConfig)
    parser.add_argument('--out', metavar='FILE.mcap', required=True, help='recording to write')
    parser.set_defaults(run=run)


def run(args):
    """Read everything lazily, write the recording."""
    is_folder = Path(args.target).is_dir()
    (_check_folder if is_folder else _check_files)(args)
    require_ending('--out', args.out, ['.mcap'])
    inputs = [args.trajectory, *args.guess, *args.truth, *args.sources]
    require_outputs(args, [('--out', args.out)], inputs if is_folder else [args.target, *inputs])
    print((_write_folder if is_folder else _write_files)(args))
    return OK


def _check_files(args):
    if not args.sources:
        raise UsageError(f'{args.target} is no folder, so it needs at least one SOURCE beside it')
    if args.trajectory or args.start:
        raise UsageError(f'--trajectory and --start are for a folder; {args.target} is none')
    for option, files in (('--guess', args.guess), ('--truth', args.truth)):
        if files and len(files) != len(args.sources):
            raise UsageError(
                f'{option} has {len(files)} files for {len(args.sources)} sources; give one each'
            )


def _check_folder(args):
    if args.sources or args.guess or args.truth:
        raise UsageError(
            f'{args.target} is a folder: its scans are the sources and its poses give guesses '
            'and truth; leave out SOURCE, --guess and --truth'
        )


def _write_files(args):
    from idem_ros.files.pose_file import read_pose
    from idem_ros.recording.from_files import file_messages
    from idem_ros.recording.writer import write_mcap

    guesses = [read_pose(file) for file in args.guess]
    truths = [read_pose(file) for file in args.truth]
    point_times = config_from(args, PointTimeConfig)
    clouds = args.target, args.sources
    messages = file_messages(*clouds, guesses, truths, args.columns, point_times)
    write_mcap(args.out, messages)
    return (
        f'{args.out}: target 1, sources {len(args.sources)}, '
        f'guesses {len(guesses)}, truths {len(truths)}'
    )


def _write_folder(args):
    from idem_ros.files.scan_folder import read_scan_folder
    from idem_ros.recording.from_files import folder_messages
    from idem_ros.recording.writer import write_mcap

    folder = read_scan_folder(args.target, args.trajectory)
    start = args.start or 'velocity'
    columns = args.columns or (None if args.trajectory else KITTI_COLUMNS)
    pairs = len(folder.scans) - 1
    messages = folder_messages(folder, start, columns, config_from(args, PointTimeConfig))
    write_mcap(args.out, progress(messages, 4 * pairs, unit='msg'))
    guess = 'the motion before' if start == 'velocity' else 'the identity'
    return f'{args.out}: {pairs} pairs of {pairs + 1} scans, each with its truth; guess: {guess}'
