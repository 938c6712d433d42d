"""The benchmarks `real` and `ablate`: on cases that no number of the solver was chosen on."""

from dataclasses import replace

from benchmarks.commands.outputs import (
    QUICK,
    add_jobs,
    add_output_options,
    check_jobs,
    check_outputs,
    check_trials,
    write,
)
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import OK, UsageError, progress


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
    ablate = kinds.add_parser(
        'ablate',
        help='what each tuned number is worth on cases that it was not chosen on',
        description='Set each tuned number to its neutral value in turn, on new scans, seeds and '
        'bodies. About a minute a number on two cores.',
    )
    ablate.add_argument('--number', action='append', metavar='NAME', help='only this one')
    ablate.add_argument('--cases', metavar='PATTERN', help='only kinds of cases that hold this')
    ablate.add_argument(
        '--trials',
        type=int,
        metavar='N',
        help='cases of each kind at most, drawn (default: all)',
    )
    add_jobs(ablate)
    add_output_options(ablate)
    ablate.set_defaults(run=_ablate)


def _real(args):
    from benchmarks.new_scans import scan_sets
    from benchmarks.real import measure_sets, real_markdown, real_record
    from benchmarks.real_pairs import SHARED
    from idem_ros.replay.peers import small_gicp

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


def _ablate(args):
    from fnmatch import fnmatchcase

    from benchmarks.ablate import ablate, compared_record, numbers
    from benchmarks.ablate_cases import unseen
    from benchmarks.ablate_report import ablation_markdown

    check_outputs(args)
    check_jobs(args)
    check_trials(args)
    known = [number.name for number in numbers()]
    for name in args.number or ():
        if name not in known:
            raise UsageError(f'--number is {name!r}; there are {", ".join(known)}')
    pattern = f'*{(args.cases or "").lower()}*'
    cases = [
        case
        for case in unseen(args.quick, args.trials)
        if fnmatchcase(case.group.lower(), pattern)
    ]
    if not cases:
        groups = ', '.join(dict.fromkeys(case.group for case in unseen()))
        raise UsageError(f'--cases is {args.cases!r}, which no kind bears; there are {groups}')
    chosen = numbers(args.number)
    compared = ablate(cases, chosen, args.jobs, progress)
    text = ablation_markdown(chosen, compared, args.trials)
    text += QUICK.format('few cases') * args.quick
    write(args, compared_record(compared), text)
    print(text)
    return OK
