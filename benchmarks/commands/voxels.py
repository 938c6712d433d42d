"""`python -m benchmarks voxels`: what `voxel_size: auto` costs and gives."""

from dataclasses import replace

from benchmarks.commands.outputs import (
    QUICK,
    add_output_options,
    check_outputs,
    write,
)
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import FAILED, OK, UsageError, progress

VOXELS = """\
From a guess some degrees off; the error is how far the source's points are off, root mean square,
the time that of the processor. The best fixed size has the most right results, of these the least
median error. Ratios are auto's over its; below what the truth itself may be off errors count
alike. Reached: right as often, error to 1.2 x, time to 1.5 x. * auto was chosen with a look at the
set.
"""


def add_parser(kinds, own):
    """Add the subcommand; own: the parameters that each case sets itself."""
    voxels = kinds.add_parser(
        'voxels',
        help='voxel_size auto beside the best of several fixed sizes; exit code 1 if it is worse',
        description='Register real pairs, where they lie beside the checkout, and simulated scans '
        'with voxels of several sizes and with those that auto takes. Ten minutes on one core.',
    )
    voxels.add_argument('--sets', metavar='PATTERN', help='only sets whose name holds this')
    add_output_options(voxels)
    add_config_options(voxels, without=own)
    voxels.set_defaults(run=_voxels)


def _voxels(args):
    from benchmarks.voxel_sets import voxel_sets
    from benchmarks.voxels import measure_voxels, voxels_table

    check_outputs(args)
    config = replace(config_from(args), assessment='verdict')  # as the node has it
    sets = [each for each in voxel_sets() if not args.sets or args.sets in each.name]
    if not sets:
        raise UsageError(f'--sets is {args.sets!r}, which no set bears')
    results = measure_voxels(sets, config, 2 if args.quick else None, progress)
    text = f'## Voxel size\n\n{VOXELS}\n{voxels_table(results)}'
    text += QUICK.format('two pairs of each set') * args.quick
    write(args, {'sets': [result.record() for result in results]}, text)
    print(text)
    return OK if all(result.reached() for result in results) else FAILED
