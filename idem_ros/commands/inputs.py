"""What commands read: clouds, recordings and their topics, results; the options that name them."""

import re
from argparse import SUPPRESS, ArgumentTypeError
from pathlib import Path

from idem_ros.core.exceptions import InvalidCloud
from idem_ros.files.columns import parse_columns
from idem_ros.refinement.preprocessing import preprocess
from idem_ros.terminal.command_line import UsageError

CLOUD_KINDS = (
    '.ply .pcd .xyz .xyzn .xyzrgb .txt .csv .tsv .pts .asc .ptx .bin .npy .npz .las .laz .e57'
)
RECORDING = 'recording: .mcap, rosbag2 folder, .db3 or ROS 1 .bag'
RESULT = 'what `idem replay --json` or --out wrote'
ROLES = {
    'target': 'PointCloud2',
    'source': 'PointCloud2',
    'guess': 'TransformStamped (or as --initial-guess-type says)',
    'truth': 'TransformStamped, PoseStamped, PoseWithCovarianceStamped, Odometry or Path',
    'imu': 'Imu, whose rates tell how the sensor turned during a sweep',
}
UNITS = {'': 1, **{unit: 2 ** (10 * (i + 1)) for i, unit in enumerate('kmg')}}


def add_columns_option(parser):
    """Add --columns, for files that do not say what their columns are."""
    parser.add_argument(
        '--columns',
        type=_columns,
        metavar='N|X,Y,Z',
        help='how many columns a .bin has; or which three columns of a table are x, y and z: '
        'their names, or their numbers from 1, as 2,3,4 (default: as the file says)',
    )


def points_of_file(file, columns, preprocessing, point_times=None, is_target=False):
    """Return the points (N, 3) of a cloud file that take part, and their times (N,) or None.

    Args:
        file, columns, point_times: see `read_timed_cloud`.
        preprocessing: `PreprocessingConfig`.
        is_target: see `preprocess`.

    Raises:
        UnreadableCloud: it cannot be read.
        InvalidCloud: none of its points takes part.
    """
    from idem_ros.files.timed_cloud import read_timed_cloud

    points, times = read_timed_cloud(file, columns, point_times)
    try:
        kept = preprocess(points, preprocessing, is_target)
    except InvalidCloud as error:
        raise InvalidCloud(f'{file}: {error}') from error
    return kept.points, None if times is None else times[kept.kept]


def add_recording(parser):
    """Add BAG, and the bound of what is inflated of it."""
    parser.add_argument('bag', metavar='BAG', help=RECORDING)
    add_max_chunk(parser)


def add_max_chunk(parser):
    """Add the bound of what is inflated; where nobody gives it, it is not in the namespace."""
    parser.add_argument(
        '--max-chunk',
        metavar='BYTES',
        type=_bytes,
        default=SUPPRESS,
        help='leave out chunks of BAG that declare to inflate to more, such as 512M (default: 1G)',
    )


def opened(bag, args):
    """Return what opens a recording, see `open_recording`, with the bound that was given."""
    from idem_ros.recording.reader import open_recording

    return open_recording(bag, **given_of(args, 'max_chunk'))


def given_of(args, *names):
    """Return {name: value} of those options that somebody gave."""
    return {name: getattr(args, name) for name in names if hasattr(args, name)}


def add_topic_options(parser):
    """Add one option for each role that a recording's topic can play."""
    for role, what in ROLES.items():
        parser.add_argument(
            f'--{role}-topic',
            metavar='NAME',
            help=f'{what} topic (default: {"none" if role == "imu" else "found by type"})',
        )
    parser.add_argument(
        '--tf-topic',
        metavar='NAME',
        type=_names,
        help='TFMessage topic, or several by commas, for --initial-guess-type tf; what is static '
        'comes from NAME_static or /tf_static (default: /tf, or the only one)',
    )


def topics_from(args):
    """Return {'target_topic': name or None, ...} as `replay` takes them."""
    return {f'{role}_topic': getattr(args, f'{role}_topic') for role in (*ROLES, 'tf')}


def add_results(parser):
    """Add RESULT, one or several."""
    parser.add_argument('results', metavar='RESULT', nargs='+', help=RESULT)


def add_recordings_under(parser, when=''):
    """Add the bound of where the recordings that results name are read."""
    parser.add_argument(
        '--recordings-under',
        metavar='FOLDER',
        help=f'{when}read only what lies in FOLDER, whatever a RESULT names (default: anything)',
    )


def refuse_files_named_twice(files):
    """Refuse one file under two names.

    Raises:
        UsageError: there is one.
    """
    if len({Path(file).resolve() for file in files}) < len(files):
        raise UsageError(f'among {", ".join(files)} a file is named twice; each must be its own')


def _names(text):
    names = [name.strip() for name in text.split(',')]
    if not all(names):
        raise ArgumentTypeError(f'{text!r} is no name, nor several by commas')
    return names


def _bytes(text):
    match = re.fullmatch(r'([1-9]\d{0,17})\s*([kmg]?)(i?b)?', text.strip().lower())
    if match is None:
        raise ArgumentTypeError(f'{text!r} is no number of bytes, such as 1073741824, 512M or 2G')
    return int(match[1]) * UNITS[match[2]]


def _columns(text):
    try:
        return parse_columns(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error
