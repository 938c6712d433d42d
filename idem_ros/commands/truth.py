"""`idem truth`: the true poses of a recording as a trajectory, or as the places of sensors."""

from pathlib import Path

from idem_ros.commands.inputs import add_recording, opened
from idem_ros.commands.output_names import require_outputs
from idem_ros.terminal.command_line import OK
from idem_ros.terminal.printable import counted

DESCRIPTION = """\
Write the true poses of BAG as TUM lines (t x y z qx qy qz qw), as `idem trajectory`
and evo read them. Where each pose is of a scan in the frame of the one before it, as
`idem bag FOLDER` writes them, they are chained, from that of the first one on.

Of a rig, where they are the places of its sensors, an --out that ends in .yaml
receives these, as `idem calibrate --start` reads them.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'truth',
        help='write the true poses of a recording as TUM lines, or those of the sensors of a rig',
        description=DESCRIPTION,
        epilog='example: idem truth drive.mcap --out truth.tum',
    )
    add_recording(parser)
    parser.add_argument(
        '--out',
        metavar='FILE',
        required=True,
        help='TUM file to write; .yaml: the places of sensors',
    )
    parser.add_argument(
        '--truth-topic',
        metavar='NAME',
        help='topic of a TransformStamped or a pose (default: that named ground_truth)',
    )
    parser.add_argument(
        '--source-topic', metavar='NAME', help='PointCloud2 topic that they are of'
    )
    parser.set_defaults(run=run)


def run(args):
    """Read, chain where they are relative, write, say what was assumed."""
    require_outputs(args, [('--out', args.out)], [args.bag])
    is_of_sensors = Path(args.out).suffix.lower() in ('.yaml', '.yml')
    write = _write_places if is_of_sensors else _write_trajectory
    with opened(args.bag, args) as recording:
        count, notes = write(recording, args)
    print(f'{args.out}: {counted(count, "pose")}')
    for note in (*notes, *dict.fromkeys(recording.warnings)):
        print(f'note: {note}')
    return OK


def _write_trajectory(recording, args):
    from idem_ros.files.pose_file import write_tum
    from idem_ros.replay.truths import read_truth

    trajectory, notes = read_truth(recording, args.truth_topic, args.source_topic)
    write_tum(args.out, trajectory.stamps, trajectory.poses)
    return len(trajectory), notes


def _write_places(recording, args):
    from idem_ros.calibration.recorded_sightings import read_true_places
    from idem_ros.calibration.result_files import places_text
    from idem_ros.files.atomic_file import replacing

    places, notes = read_true_places(recording, args.truth_topic)
    with replacing(args.out) as path:
        path.write_text(places_text(places), encoding='utf-8', errors='backslashreplace')
    return len(places), notes
