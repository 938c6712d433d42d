"""`python -m benchmarks several`: several clouds at once beside pairs, held against figures."""

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

TRIALS = 2
TEXT = """\
# Several clouds at once

`python -m benchmarks several --trials {trials} --markdown docs/bench_several.md`

Rings of scans around bodies with much relief, sampled independently, 0.2 mm of noise, voxels of
2 mm, every start 1° and 1 mm off; {trials} bodies for each row, which no number was chosen on.
How far each scan's rotation is off, the common turn left out: median / p90. Beside them pairs by
`register`: in a chain; in a graph of all pairs that overlap by a tenth, weighed by their
covariances (least squares from the truth); and as Open3D's multiway registration has it, by
small_gicp's GICP, weighed by correspondences, at the better of two distances. Noise alone is the
Cramér-Rao bound: what the points' noise leaves open where nobody knows the surface; no unbiased
method is below it, so that where two methods reach it neither can be 0.7 times the other. The last
column is how far above it the poses found at once are: about 1, nothing is left to gain.

{rings}
The dragon is Stanford's ring of 15 scans, its truth good to 0.1 to 0.3°; starts 1.5° and 2 mm
off. Times are from raw points to poses, without verdicts, the least of three runs; that of the
processor does not depend on who else uses the machine.

{worst}{goals}"""


def add_parser(kinds, without):
    """Add the subcommand."""
    parser = kinds.add_parser(
        'several',
        help='several clouds at once beside pairs; exit code 1 if a figure is missed',
    )
    add_trials(parser, TRIALS, 'bodies for each ring')
    add_output_options(parser)
    add_config_options(parser, without=without)
    parser.set_defaults(run=_run)


def _run(args):
    """Measure, print and write."""
    from benchmarks.goal import goals_table
    from benchmarks.several.measure import (
        RINGS,
        dragon_goals,
        lidar_goals,
        measure_rings,
        promise_goals,
        ring_goals,
        rings_table,
    )

    check_trials(args)
    check_outputs(args)
    config, trials = config_from(args), 1 if args.quick else args.trials
    rings = RINGS[1:2] if args.quick else RINGS
    found, promises = measure_rings(config, trials, rings, progress)
    of_dragon, worst = dragon_goals(config)
    goals = [*ring_goals(found), *promise_goals(promises), *of_dragon]
    goals += [] if args.quick else lidar_goals(config)
    text = TEXT.format(
        trials=trials, rings=rings_table(found), worst=worst, goals=goals_table(goals)
    )
    text += QUICK.format('one body and one ring') if args.quick else ''
    print(text)
    record = {
        'trials': trials,
        'rings': [
            {'scans': count, 'overlap': overlap}
            | {'squared_errors_over_covariance': promises[count, overlap]}
            | {'errors_deg': {method: each.tolist() for method, each in errors.items()}}
            for (count, overlap), errors in found.items()
        ],
        'goals': [goal.record() for goal in goals],
    }
    write(args, record, text)
    return OK if all(goal.reached for goal in goals) else FAILED
