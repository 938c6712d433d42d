"""`idem bench real`: on scans that no number of the solver was chosen on."""

from dataclasses import replace

from idem_ros.commands.bench_outputs import (
    QUICK,
    add_output_options,
    check_outputs,
    progress,
    write,
)
from idem_ros.commands.exit_codes import OK, UsageError
from idem_ros.commands.options import add_config_options, config_from


def add_parsers(kinds, own):
    """Add the subcommands; own: the parameters that each case sets itself."""
    real = kinds.add_parser(
        'real',
        help='errors and time on real scans that no number was chosen on',
        description="Register the dragon's ring, KITTI 00 in traffic and frames of a depth "
        'camera, where they lie beside the checkout, with IDEM and small_gicp, each peer at its '
        'best voxel size and setting. A quarter of an hour on one core.',
    )
    add_output_options(real)
    add_config_options(real, without=own)
    real.set_defaults(run=_real)


def _real(args):
    from idem_ros.benchmarks.methods import small_gicp
    from idem_ros.benchmarks.new_scans import scan_sets
    from idem_ros.benchmarks.real import measure_sets, real_markdown, real_record
    from idem_ros.benchmarks.real_pairs import SHARED

    check_outputs(args)
    config = replace(config_from(args), assessment='none')
    small_gicp()
    sets = scan_sets()
    if not sets:
        raise UsageError(f'none of the scans is in {SHARED}')
    figures = measure_sets(sets, config, args.quick, progress)
    text = real_markdown(figures, sets) + QUICK.format('few pairs') * args.quick
    write(args, real_record(figures), text)
    print(text)
    return OK
