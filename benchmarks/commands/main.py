"""`python -m benchmarks`: accuracy and time, side by side with the methods of small_gicp."""

import sys
from dataclasses import replace

from benchmarks.commands import (
    beyond,
    bounded,
    docs,
    maps,
    real,
    rigs,
    several,
    smooth,
    sweeps,
    tunnels,
    voxels,
)
from benchmarks.commands.outputs import (
    QUICK,
    add_jobs,
    add_output_options,
    check_jobs,
    check_outputs,
    check_trials,
    write,
)
from idem_ros.commands.main import run
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import FAILED, OK, CommandLine, UsageError, progress

OWN = ('voxel_size', 'mode', 'assessment')  # each row has its own; no peer says how sure it is

RINGS = """\
Three registrations around a ring of scans should close, and those of one pair at two voxel sizes
agree; by how much they do not is what the scans themselves leave open, whatever their truth.
From the truth; each peer at the setting that closes best."""


def main(argv=None):
    """Run a benchmark by the given arguments (None: the process's); return its exit code."""
    return run(_parser(), sys.argv[1:] if argv is None else argv)


def _parser():
    parser = CommandLine(
        prog='python -m benchmarks',
        description='Measure IDEM beside the methods of small_gicp (the extra "bench").',
    )
    kinds = parser.add_subparsers(title='benchmarks', metavar='BENCHMARK')
    _add_accuracy(kinds)
    _add_speed(kinds)
    rings = kinds.add_parser(
        'rings', help="how far registrations around rings of the bunny's scans fail to close"
    )
    add_output_options(rings)
    add_config_options(rings, without=OWN)
    rings.set_defaults(run=_rings)
    bounded.add_parser(kinds)
    real.add_parsers(kinds, OWN)
    voxels.add_parser(kinds, OWN)
    maps.add_parser(kinds, OWN)
    several.add_parser(kinds, OWN)
    smooth.add_parser(kinds, OWN)
    rigs.add_parser(kinds, ('mode', 'assessment'))
    for name, measured, what in (
        ('main', _main, "the main job's figures"),
        ('evaluation', _evaluation, 'what evaluating costs beside the refinements'),
    ):
        goals = kinds.add_parser(name, help=f'{what}; exit code 1 if one is missed')
        add_output_options(goals)
        add_config_options(goals, without=OWN)
        goals.set_defaults(run=measured)
    _add_trust(kinds)
    _add_pages(kinds)
    sweeps.add_parser(kinds)
    tunnels.add_parser(kinds)
    beyond.add_parsers(kinds)
    docs.add_parser(kinds)
    return parser


def _add_pages(kinds):
    """Add what measures and draws pages."""
    report = kinds.add_parser(
        'report', help='time and size of a report of 1000 frames; exit code 1 if one is missed'
    )
    add_output_options(report)
    report.set_defaults(run=_report)
    viewer = kinds.add_parser(
        'viewer', help='frames a second of the viewer in a browser; exit code 1 if too few'
    )
    add_output_options(viewer)
    viewer.set_defaults(run=_viewer)
    gallery = kinds.add_parser('gallery', help='the pictures of docs/gallery.md')
    gallery.add_argument(
        '--out', metavar='DIR', default='docs/gallery', help='(default: %(default)s)'
    )
    gallery.set_defaults(run=_gallery)


def _add_speed(kinds):
    speed = kinds.add_parser(
        'speed',
        help='time, memory, and time to accuracy',
        description='Measure from raw points to result with one thread and two, the time to the '
        "best peer's accuracy, q_tot alone, peak memory and the first result of a process. A "
        'quarter of an hour on a machine that does nothing else.',
    )
    add_output_options(speed)
    add_config_options(speed, without=OWN)
    speed.set_defaults(run=_speed)


def _add_accuracy(kinds):
    accuracy = kinds.add_parser(
        'accuracy',
        help='errors and success from many starts',
        description='Register simulated scenes, samplings of a surface and, where they lie beside '
        'the checkout, real scans with IDEM and every method of small_gicp, each at its best '
        'setting, from starts 1 to 8 spacings and 2 to 15 degrees off. An hour on two cores.',
    )
    accuracy.add_argument('--rows', metavar='PATTERN', help='only rows whose name holds this')
    add_jobs(accuracy)
    accuracy.add_argument(
        '--peers',
        metavar='FILE',
        help='run IDEM alone; take the other methods from the --json of an earlier run',
    )
    add_output_options(accuracy)
    add_config_options(accuracy, without=OWN)
    accuracy.set_defaults(run=_accuracy)


def _accuracy(args):
    from benchmarks import accuracy_report
    from benchmarks.accuracy import measure_rows
    from benchmarks.earlier import with_peers_of
    from benchmarks.rows import accuracy_rows
    from idem_ros.replay.peers import small_gicp

    config = _config(args)
    check_jobs(args)
    if not args.peers:
        small_gicp()
    rows = accuracy_rows(args.rows, args.quick)
    if not rows:
        names = ', '.join(row.name for row in accuracy_rows())
        raise UsageError(f'--rows is {args.rows!r}, which no row bears; there are {names}')
    tried = () if args.peers else _tried(args)
    results = measure_rows(rows, tried, config, args.jobs, progress)
    if args.peers:
        results = with_peers_of(results, args.peers)
    text = accuracy_report.markdown(results)
    text += QUICK.format('few cases and few settings of the peers') * args.quick
    write(args, accuracy_report.json_record(results), text)
    print(accuracy_report.summary(results) if args.markdown else text)
    return OK


def _tried(args):
    """Return the peers' settings."""
    from benchmarks.methods import settings

    return settings((3.0, 10.0), (1.5, 3.0)) if args.quick else settings()


def _rings(args):
    from dataclasses import asdict

    from benchmarks.methods import small_gicp
    from benchmarks.real_pairs import SHARED
    from benchmarks.rings import measure_rings, rings_table

    config = _config(args)
    small_gicp()
    rings = measure_rings(config, [*_tried(args)], args.quick, progress)
    if not rings:
        raise UsageError(f"neither the bunny's scans nor small_gicp's are in {SHARED}")
    text = f'## Rings\n\n{RINGS}\n\n{rings_table(rings)}'
    write(args, {'rings': [asdict(ring) for ring in rings]}, text)
    print(text)
    return OK


def _speed(args):
    from benchmarks import speed_report
    from benchmarks.goal import goals_table
    from benchmarks.methods import small_gicp
    from benchmarks.speed_run import measure

    config = _config(args)
    small_gicp()
    result = measure(config, args.quick, progress)
    text = speed_report.markdown(result)
    text += QUICK.format('one scene and few runs') * args.quick
    write(args, speed_report.json_record(result), text)
    print(goals_table(speed_report.goals(result)) if args.markdown else text)
    return OK


def _main(args):
    from benchmarks.main_job import measure
    from benchmarks.real_pairs import SHARED, real_pairs

    config = replace(_config(args), assessment='verdict')  # as the node has it
    goals = measure(config, args.quick, progress)
    about = '' if real_pairs() else f'Without the real pairs: {SHARED} is not there.\n\n'
    return _told(args, 'Main job', goals, about)


def _evaluation(args):
    from benchmarks.evaluation import measure

    return _told(args, 'Evaluation', measure(_config(args), args.quick, progress))


def _add_trust(kinds):
    trust = kinds.add_parser(
        'trust',
        help='how far verdict, covariance and free motions hold; exit code 1 if one is missed',
        description='Judge the verdict as it is shipped, and the covariance, in kinds of place, '
        'by sensors and on real scans that none of their numbers was fitted on; models fitted '
        'anew without a kind, on that kind (cross-validated); and what they cost.',
    )
    trust.add_argument('--trials', type=int, metavar='N', help='cases of a kind, in each part')
    trust.add_argument('--part', action='append', metavar='NAME', help='only this one')
    add_jobs(trust)
    add_output_options(trust)
    add_config_options(trust, without=OWN)
    trust.set_defaults(run=_trust)


def _trust(args):
    from benchmarks.methods import small_gicp
    from benchmarks.trust.measure import COST_PART, PARTS, measure

    config = _config(args)
    check_jobs(args)
    known = (*PARTS, COST_PART)
    for name in args.part or ():
        if name not in known:
            raise UsageError(f'--part is {name!r}; there are {", ".join(known)}')
    check_trials(args)
    trials = args.trials or (2 if args.quick else None)
    small_gicp()
    return _told(args, 'Trust', measure(config, trials, args.part, args.jobs, progress))


def _report(args):
    from benchmarks.main_job import DEMO, DemoMissing
    from benchmarks.report_cost import FRAMES, measure
    from idem_ros.files.installed_file import installed_file

    _config(args)
    path = installed_file(DEMO)
    if path is None:
        raise DemoMissing(f'{DEMO} is not here; it lies in the checkout')
    return _told(args, 'Report', measure(path, FRAMES // 10 if args.quick else FRAMES))


def _viewer(args):
    from benchmarks.viewer_rate import ABOUT, POINTS, measure

    check_outputs(args)
    goals = measure(POINTS // 10 if args.quick else POINTS)
    return _told(args, 'Viewer', goals, ABOUT)


def _gallery(args):
    from pathlib import Path

    from benchmarks.gallery import MOST_BYTES, draw

    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    drawn = dict(draw(folder))
    for name, size in drawn.items():
        print(f'{name}: {size}' + (' bytes' if isinstance(size, int) else ''))
    small = all(isinstance(size, int) and size <= MOST_BYTES for size in drawn.values())
    return OK if small else FAILED


def _told(args, title, goals, about=''):
    from benchmarks.goal import goals_table

    text = f'## {title}\n\n{about}' + goals_table(goals)
    write(args, {'goals': [goal.record() for goal in goals]}, text)
    print(text)
    return OK if all(goal.reached for goal in goals) else FAILED


def _config(args):
    """Return the configuration; refuse before the work what could not be written after it."""
    check_outputs(args)
    return replace(config_from(args), assessment='none')
