"""`idem simulate`: record a simulated drive with exact truth."""

import math
from functools import partial

from idem_ros.commands.output_names import (
    require_ending,
    require_outputs,
)
from idem_ros.terminal.command_line import OK, UsageError, progress

SCANS, MAP_POINTS, SEED = 21, 80_000, 0
EXTENT, LARGEST_EXTENT = 2000.0, 20_000.0  # [m] of a town
SCENES = ('street', 'room', 'forest', 'tunnel')
TURN_RATE_DEG, SWEEP_S = 0.0, 0.1
MOST_LIDARS, LEAST_VIEW_DEG = 8, 30.0
FASTEST, FASTEST_TURN_DEG, LONGEST_SWEEP = 100.0, 720.0, 1.0


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'simulate',
        help='record a simulated drive with exact truth',
        description='Drive a LiDAR through a simulated scene and write an MCAP: a map on '
        '/target, scans on /source, guesses that are 1.5 deg and 0.3 m off on /initial_guess, '
        'and the exact poses on /ground_truth. The defaults make bags/demo.mcap, whose scans are '
        'each taken from one pose. With --speed the sensor drives while it scans: each point has '
        'its time, in the field "time", and the guesses are an odometry of 5 % error. With '
        '--map city it is a town of kilometres, and --out a new folder: the map in tiles as map/, '
        'a drive at 15 m/s and 10 Hz as drive.mcap. With --lidars a rig of several is driven: '
        'clouds on /lidar_0/points and so on, where they are mounted on /tf_static, 5 deg and '
        '0.1 m off, and where they truly are on /ground_truth.',
    )
    parser.add_argument(
        '--out', metavar='FILE.mcap', required=True, help='recording, or folder, to write'
    )
    parser.add_argument('--map', choices=('city',), help='a map on disk, written piece by piece')
    parser.add_argument(
        '--extent',
        type=float,
        metavar='M',
        help=f'with --map, the length of its sides (default: {EXTENT:g})',
    )
    parser.add_argument('--seed', type=int, default=SEED, help='(default: %(default)s)')
    parser.add_argument('--scans', type=int, default=SCANS, help='(default: %(default)s)')
    parser.add_argument(
        '--lidars', type=int, metavar='N', help=f'a rig of so many, 2 to {MOST_LIDARS}'
    )
    parser.add_argument(
        '--view',
        type=float,
        metavar='DEG',
        help='with --lidars, how much of the horizon each sees (default: 1.9 times its share; of '
        'less than that share they have no view in common)',
    )
    _add_motion(parser)
    parser.set_defaults(run=run)


def _add_motion(parser):
    parser.add_argument(
        '--scene', choices=SCENES, default=SCENES[0], help='(default: %(default)s)'
    )
    parser.add_argument('--speed', type=float, metavar='M/S', help='drive while scanning')
    parser.add_argument(
        '--turn-rate',
        type=float,
        metavar='DEG/S',
        help=f'the fastest that it turns, with --speed (default: {TURN_RATE_DEG:g})',
    )
    parser.add_argument(
        '--sweep', type=float, metavar='S', help=f'what a scan takes (default: {SWEEP_S:g})'
    )


def run(args):
    """Simulate and write."""
    from importlib import import_module

    import numpy as np

    from idem_ros.recording.writer import write_mcap
    from idem_ros.simulation.recording import drive_messages, moving_messages

    if args.seed < 0 or args.scans < 2:
        raise UsageError(
            f'--seed is {args.seed} and --scans {args.scans}; they must be from 0 and from 2'
        )
    if args.map:
        return _city(args)
    if args.extent is not None:
        raise UsageError('--extent is of a map: give --map city, too')
    if args.view is not None and args.lidars is None:
        raise UsageError('--view is of a rig: give --lidars, too')
    require_ending('--out', args.out, ['.mcap'])
    motion = _motion(args)
    require_outputs(args, [('--out', args.out)])
    rng = np.random.default_rng(args.seed)
    scene = getattr(import_module(f'idem_ros.simulation.{args.scene}'), args.scene)(rng)
    if args.lidars is not None:
        return _rig(args, scene, motion, rng)
    if motion is None:
        messages = drive_messages(scene, args.scans, MAP_POINTS, rng)
    else:
        messages = moving_messages(scene, motion, args.scans, MAP_POINTS, rng)
    write_mcap(args.out, messages)
    print(f'{args.out}: {args.scans} scans against a map of {MAP_POINTS} points')
    return OK


def _rig(args, scene, motion, rng):
    """Write a rig of several LiDARs."""
    from idem_ros.recording.writer import write_mcap
    from idem_ros.simulation.rig import rig_messages

    if not 2 <= args.lidars <= MOST_LIDARS:
        raise UsageError(f'--lidars is {args.lidars}; it must be from 2 to {MOST_LIDARS}')
    if args.view is not None and not LEAST_VIEW_DEG <= args.view <= 360.0:
        raise UsageError(f'--view is {args.view:g}; it must be from {LEAST_VIEW_DEG:g} to 360')
    write_mcap(args.out, rig_messages(scene, args.lidars, motion, args.scans, rng, args.view))
    print(f'{args.out}: {args.scans} scans of each of {args.lidars} LiDARs')
    return OK


def _city(args):
    """Write a town as a map in tiles and a drive."""
    from idem_ros.files.atomic_file import filling
    from idem_ros.simulation.city import LEAST_BLOCKS, blocks_of, write_city
    from idem_ros.simulation.town import BLOCK

    if args.scene != SCENES[0] or args.speed is not None or args.lidars is not None:
        raise UsageError('--map city is a town of its own, driven at 15 m/s: leave out the rest')
    extent = EXTENT if args.extent is None else args.extent
    if not LEAST_BLOCKS * BLOCK <= extent <= LARGEST_EXTENT:
        bounds = f'from {LEAST_BLOCKS * BLOCK:g} to {LARGEST_EXTENT:g}'
        raise UsageError(f'--extent is {extent:g}; it must be {bounds}')
    with filling(args.out) as folder:
        points = write_city(
            folder, extent, args.scans, args.seed, partial(progress, unit='street')
        )
    side = blocks_of(extent) * BLOCK
    town = f'a town of {points} points and {side:g} x {side:g} m, map'
    print(f'{args.out}: {args.scans} scans, drive.mcap, in {town}')
    return OK


def _motion(args):
    """Return the `Motion` that is asked for; None: every scan is from one pose."""
    from idem_ros.simulation.recording import Motion

    given = args.speed, args.turn_rate, args.sweep
    if args.speed is None:
        if any(each is not None for each in given):
            raise UsageError('--turn-rate and --sweep are of a drive: give --speed, too')
        return None
    turn_rate = TURN_RATE_DEG if args.turn_rate is None else args.turn_rate
    sweep = SWEEP_S if args.sweep is None else args.sweep
    for name, value, low, high in (
        ('--speed', args.speed, 0.0, FASTEST),
        ('--turn-rate', turn_rate, 0.0, FASTEST_TURN_DEG),
        ('--sweep', sweep, 0.01, LONGEST_SWEEP),
    ):
        if not low <= value <= high:
            raise UsageError(f'{name} is {value:g}; it must be from {low:g} to {high:g}')
    return Motion(args.speed, math.radians(turn_rate), sweep)
