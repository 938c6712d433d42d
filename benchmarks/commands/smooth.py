"""`python -m benchmarks smooth`: a trajectory made consistent, held against figures."""

from benchmarks.commands.outputs import (
    QUICK,
    add_output_options,
    add_trials,
    check_outputs,
    check_trials,
    write,
)
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import FAILED, OK, progress

TRIALS, SEEDS, MAPS, VOXEL_SIZE = 2, 2, 12, 0.5
TEXT = """\
# A trajectory made consistent

`python -m benchmarks smooth --trials {trials} --markdown docs/bench_smooth.md`

Drives of 200 simulated scans (32 rings) twice about a block of a town, 720 m; an odometry whose
steps are off by 0.1° and 30 mm each; voxels of {voxel_size:g} m, two worker processes, from the
recording to the map. Mean errors of all poses in the frame of the first, before and after:

{drives}
Maps of 16 scans of two passes through {scenes} scenes, of poses off by 5 to 150 mm and a tenth of
that in rad, the second pass thinned to a half, a fifth, a tenth: Spearman's rank correlation with
how far the poses are truly off, of the [score](smooth.md#the-score-of-a-map) and of the mean map
entropy, in places that no number was chosen on. Between places the entropy tells the place.

{maps}
{goals}
The memory is the greatest of the process and its workers. The time is for a machine that does
nothing else; that of the processor depends less on who else uses it.
"""


def add_parser(kinds, without):
    """Add the subcommand."""
    parser = kinds.add_parser(
        'smooth',
        help='a trajectory made consistent: errors, time, memory, and the score of the map; exit '
        'code 1 if a figure is missed',
    )
    add_trials(parser, TRIALS, 'drives')
    add_output_options(parser)
    add_config_options(parser, without=without)
    parser.set_defaults(run=_run)


def _run(args):
    """Measure, print and write."""
    from dataclasses import asdict, replace
    from pathlib import Path
    from tempfile import TemporaryDirectory

    from benchmarks.goal import goals_table
    from benchmarks.smooth import maps, measure

    check_trials(args)
    check_outputs(args)
    config = replace(config_from(args), voxel_size=VOXEL_SIZE)
    quick = args.quick
    trials, scans = (1, 40) if quick else (args.trials, measure.SCANS)
    driven = measure.measure_drives(config, trials, scans, progress)
    goals = measure.drive_goals(driven)
    goals += [] if quick else [measure.memory_goal()]
    seeds, count = (1, 4) if quick else (SEEDS, MAPS)
    with TemporaryDirectory() as folder:
        rows = maps.measure_maps(seeds, count, Path(folder), progress)
    goals += maps.map_goals(rows)
    text = TEXT.format(
        trials=trials,
        voxel_size=VOXEL_SIZE,
        drives=measure.drives_table(driven),
        scenes=len(maps.SCENES) * seeds,
        maps=maps.maps_table(rows),
        goals=goals_table(goals),
    )
    text += QUICK.format('40 scans and few maps') if quick else ''
    print(text)
    record = {
        'drives': [asdict(each) for each in driven],
        'maps': rows,
        'goals': [goal.record() for goal in goals],
    }
    write(args, record, text)
    return OK if all(goal.reached for goal in goals) else FAILED
