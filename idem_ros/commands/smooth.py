"""`idem smooth`: the trajectory of a recording made consistent, with loops closed and a map."""

import sys
from contextlib import closing
from functools import partial

from idem_ros.commands.inputs import add_recording, given_of
from idem_ros.commands.options import (
    OF_PAIRS,
    add_config_options,
    add_worker_options,
    config_from,
    workers_from,
)
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.terminal.command_line import FAILED, OK, UsageError, progress
from idem_ros.terminal.printable import printable

DECIDED = (
    *('mode', 'assessment', 'budget_ms', 'threads', 'guess_sigma', 'twist_sigma'),
    *('motion_reference', 'audit_tolerance'),
)
OTHERS = PreprocessingConfig, PointTimeConfig, SmoothingConfig
DESCRIPTION = """\
Take the scans of BAG, with the poses of a trajectory of their sensor, and make all
of them agree. Keyframes are registered at once, window by window, with the
trajectory as a prior; pairs that are near one another long after, and those of
--loops, are tried as loops, and count where their verdict is aligned; one graph of
all that counts gives the poses. DIR, a new folder, receives

  trajectory.tum    the pose of every scan
  graph.g2o         the keyframes, and what counts, with information
  covariances.csv   of each keyframe's pose, relative to the first
  map.pcd           the keyframes' points, one of each voxel
  smooth.json       scores of the map, what was tried and its verdicts, settings

Printed are the scores of the map with the poses as given and as found: how much the
entropy of the scans joined is above that of each alone, in nats, across the surface,
where two scans or more meet; the same where passes meet; and the mean map entropy.

Points wait in DIR until all is done: the memory does not grow with the recording.
Exit code: 0 all keyframes hang together, 1 they do not, or the scans contradict most of the
trajectory (what there is, is written), or BAG cannot be used, 2 the command line is wrong,
130 interrupted: DIR is not made.
"""
EPILOG = """\
examples:
  idem replay drive.mcap --sequence scan --voxel-size 0.5 --tum drive.tum
  idem smooth drive.mcap --trajectory drive.tum --voxel-size 0.5 --out smoothed
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'smooth',
        help='make the trajectory of a recording consistent; a map and its score',
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    add_recording(parser)
    parser.add_argument(
        '--trajectory',
        metavar='FILE',
        required=True,
        help="poses of the scans' frame: TUM lines, a .csv with the header "
        'stamp,x,y,z,qx,qy,qz,qw, or what `idem replay --sequence` wrote with --json or --out',
    )
    parser.add_argument('--out', metavar='DIR', required=True, help='new folder for the results')
    parser.add_argument(
        '--loops',
        metavar='FILE',
        help='pairs of stamps [s], two in a line, of scans that see the same place: tried as '
        'loops however far apart the trajectory has them',
    )
    parser.add_argument(
        '--source-topic', metavar='NAME', help='PointCloud2 topic (default: found by type)'
    )
    add_worker_options(parser, 'DIR by the same path')
    add_config_options(parser, without=DECIDED, choices={'motion': ('none', 'guess')})
    for config_type in OTHERS:
        add_config_options(parser, OF_PAIRS, config_type)
    parser.set_defaults(run=run)


def run(args):
    """Make consistent, write, print."""
    from idem_ros.files.atomic_file import filling
    from idem_ros.smoothing.run import smooth

    workers = workers_from(args)
    asked = _asked(args)
    messages = partial(progress, unit='msg')
    with filling(args.out) as folder:
        record = smooth(asked, folder.absolute(), lambda tasks: _done(tasks, workers), messages)
    _print(record, args.out)
    is_doubtful = 2 * record['contradicted'] > record['keyframes'] - 1
    return OK if record['parts'] == 1 and not is_doubtful else FAILED


def _asked(args):
    from idem_ros.replay.settings import Settings
    from idem_ros.smoothing.run import Asked

    config = config_from(args)
    if config.voxel_size is None:
        raise UsageError('--voxel-size is none; scans of a whole recording are joined on voxels')
    preprocessing, point_times, smoothing = (config_from(args, kind) for kind in OTHERS)
    others = given_of(args, 'max_chunk')
    try:
        settings = Settings(
            config=config, preprocessing=preprocessing, point_times=point_times, **others
        )
    except InvalidConfig as error:
        raise UsageError(str(error)) from error
    return Asked(args.bag, args.trajectory, settings, smoothing, args.source_topic, args.loops)


def _done(tasks, workers):
    """Yield (index, what was found) of each task, as it is done."""
    from idem_ros.smoothing.joining import joined

    with closing(workers(tasks, call=joined)) as ended:
        yield from progress(ended, len(tasks), unit='window')


def _print(record, out):
    """Print a record in a few lines, and what was left out on stderr."""
    for what, said in (('note', record['notes']), ('not done', record['failures'])):
        for each in said:
            print(printable(f'{what}: {each}'), file=sys.stderr)
    for line in _lines(record):
        print(line)
    print(_scores(record['map']))
    points = record['map']['points']
    print(printable(f'{out}: trajectory, graph, covariances, and a map of {points} points'))


def _lines(record):
    """Yield what was joined, and what hangs together."""
    yield (
        f'{record["scans"]} scans, {record["keyframes"]} keyframes on voxels of '
        f'{record["map"]["voxel_size"]:.6g} m; keyframes moved by {record["moved_m"]["mean"]:.3g} '
        f'm in the mean, {record["moved_m"]["most"]:.3g} m at most'
    )
    for is_loop, name in ((False, 'neighbours'), (True, 'loops')):
        tried = [each for each in record['relations'] if each['is_loop'] == is_loop]
        counting = sum(each['counts'] for each in tried)
        yield f'{name}: {counting} of {len(tried)} agree and count'
    if record['parts'] > 1:
        yield (
            f'the keyframes fall into {record["parts"]} parts that only the trajectory holds '
            'together' + _alone(record['alone'])
        )


def _scores(record):
    from idem_ros.terminal.markdown import number, table

    names = 'score', 'score_of_passes', 'mean_map_entropy'
    rows = [
        (name, *(number(record[name.replace(' ', '_')][each]) for each in names))
        for name in ('as given', 'smoothed')
    ]
    return table(('map', 'score [nat]', 'of passes [nat]', 'mean map entropy [nat]'), rows)


def _alone(stamps):
    if not stamps:
        return ''
    shown = ', '.join(f'{stamp / 1e9:.3f}' for stamp in stamps[:5])
    more = f' and {len(stamps) - 5} more' if len(stamps) > 5 else ''
    return f'; of one keyframe alone: at {shown}{more} s'
