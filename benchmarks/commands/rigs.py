"""`python -m benchmarks calibrate`: rigs of LiDARs from far starts, held against figures."""

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

TRIALS = 24
TEXT = """\
# Rigs of LiDARs calibrated

`python -m benchmarks calibrate --trials {trials} --markdown docs/bench_rigs.md`

Rigs of 2 to 5 simulated LiDARs of 32 rings that look outwards, each over a part of the horizon;
two in streets for one in rooms; 15 mm of noise; {trials} rigs, which no number was chosen on. Of
what two see, 15 to 60 % has a neighbour in the other, for as many pairs as link all. Every sensor
but the first starts off by so much. Right is within 5 cm and 0.5°.

{rigs}
Rigs of three drive through streets, in bends of up to 20 deg/s; no sensor begins its sweep when
the others do; from 5° and 0.1 m off, by 5 instants, each put to one time. The mean of the squared
errors over the promised covariance, NEES, should be 1.

{drives}
The captures are of one car with a LiDAR on its roof and two of a near field at its sides
(OpenCalib), from its nominal extrinsics, 45° off; each is calibrated alone. Their truth is not
known: that both say the same is what is asked for, within 20 mm and 0.15°, or within three of the
standard deviations that are promised.

{captures}
{goals}"""


def add_parser(kinds, without):
    """Add the subcommand."""
    parser = kinds.add_parser(
        'calibrate',
        help='rigs of LiDARs calibrated from far starts; exit code 1 if a figure is missed',
    )
    add_trials(parser, TRIALS, 'rigs')
    add_output_options(parser)
    add_config_options(parser, without=without)
    parser.set_defaults(run=_run)


def _run(args):
    """Measure, print and write."""
    from benchmarks.goal import goals_table
    from benchmarks.rigs.captures import capture_goals
    from benchmarks.rigs.driven import drive_goals, drives_table, measure_drives
    from benchmarks.rigs.measure import measure_rigs, rig_goals, rigs_table

    check_trials(args)
    check_outputs(args)
    config, trials = config_from(args), 2 if args.quick else args.trials
    found = measure_rigs(config, trials, progress)
    driven = measure_drives(config, trials, progress)
    of_captures, captures = capture_goals(config)
    goals = [*rig_goals(found), *drive_goals(driven), *of_captures]
    tables = {
        'rigs': rigs_table(found),
        'drives': drives_table(driven),
        'captures': captures,
        'goals': goals_table(goals),
    }
    text = TEXT.format(trials=trials, **tables)
    text += QUICK.format('two rigs') if args.quick else ''
    print(text)
    record = {
        'trials': trials,
        'rigs': [
            {'off_deg': level[0], 'off_m': level[1], 'instants': instants}
            | {'sensors': [each._asdict() for each in errors]}
            for (level, instants), errors in found.items()
        ],
        'drives': [
            {**drive._asdict(), 'sensors': [each._asdict() for each in errors]}
            for drive, errors in driven.items()
        ],
        'goals': [goal.record() for goal in goals],
    }
    write(args, record, text)
    return OK if all(goal.reached for goal in goals) else FAILED
