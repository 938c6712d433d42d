"""`idem bag`: make a recording out of cloud files."""

from idem_ros.commands.exit_codes import OK, UsageError

START = 10**9  # [ns]; a stamp of 0 would mean "timeless"
STEP = 10**8  # [ns] between scans
FINEST_STEP = 1e-5  # of a cloud's extent
GUESS_DELAY, TRUTH_DELAY = 10**6, 2 * 10**6  # [ns]: of equal log times no format keeps the order


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'bag',
        help='make a recording out of cloud files',
        description='Write an MCAP with TARGET once and each SOURCE with its guess and truth, '
        'on /target, /source, /initial_guess and /ground_truth.',
    )
    parser.add_argument('target', metavar='TARGET', help='cloud file (.ply .pcd .xyz .bin .npy)')
    parser.add_argument('sources', metavar='SOURCE', nargs='+', help='cloud files')
    pose = 'pose of each SOURCE in the frame of TARGET: a 4x4 matrix or one TUM line'
    parser.add_argument('--guess', metavar='FILE', nargs='+', default=[], help=f'initial {pose}')
    parser.add_argument('--truth', metavar='FILE', nargs='+', default=[], help=f'true {pose}')
    parser.add_argument('--out', metavar='FILE.mcap', required=True, help='recording to write')
    parser.set_defaults(run=run)


def run(args):
    """Read everything lazily, write the recording."""
    from idem_ros.atomic_file import require_writable
    from idem_ros.pose_files import read_pose
    from idem_ros.recording.writer import write_mcap

    for option, files in (('--guess', args.guess), ('--truth', args.truth)):
        if files and len(files) != len(args.sources):
            raise UsageError(
                f'{option} has {len(files)} files for {len(args.sources)} sources; give one each'
            )
    if not args.out.endswith('.mcap'):
        raise UsageError(f'--out is {args.out}; its name must end in .mcap')
    require_writable(args.out)
    guesses = [read_pose(file) for file in args.guess]
    truths = [read_pose(file) for file in args.truth]
    write_mcap(args.out, _messages(args.target, args.sources, guesses, truths))
    print(
        f'{args.out}: target 1, sources {len(args.sources)}, '
        f'guesses {len(guesses)}, truths {len(truths)}'
    )
    return OK


def _messages(target, sources, guesses, truths):
    """Yield (topic, log time, message) in the order of a live run."""
    from idem_ros.recording.messages import transform_message

    yield '/target', START, _cloud(target, START, 'target')
    for i, source in enumerate(sources):
        stamp = START + (i + 1) * STEP
        yield '/source', stamp, _cloud(source, stamp, 'source')
        for topic, delay, poses in (
            ('/initial_guess', GUESS_DELAY, guesses),
            ('/ground_truth', TRUTH_DELAY, truths),
        ):
            if poses:
                message = transform_message(poses[i], stamp, 'target', 'source')
                yield topic, stamp + delay, message


def _cloud(path, stamp, frame_id):
    import numpy as np

    from idem_ros.cloud_files import read_cloud
    from idem_ros.recording.messages import cloud_message

    points = read_cloud(path)
    largest, extent = np.abs(points).max(), np.ptp(points, axis=0).max()
    # float32 unless it would blur the cloud: at map coordinates (1e6 m) its step is 6 cm
    is_fine = np.spacing(np.float32(largest)) <= FINEST_STEP * extent
    return cloud_message(points, stamp, frame_id, np.float32 if is_fine else np.float64)
