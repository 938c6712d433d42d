"""`python -m benchmarks bounded`: what garbage costs, and whether budgets are kept."""

from benchmarks.commands.outputs import (
    QUICK,
    add_output_options,
    check_outputs,
    write,
)
from idem_ros.terminal.command_line import FAILED, OK, progress

TEXT = """## Bounded work

Clouds that are no scans beside scans of a street, a room, woods and a tunnel of as many points,
in the time of the processor over that of the slowest scan; in a map, what is near already is
prepared. And how much longer than allowed, 1.2 x or 20 ms more, registrations take that have a
budget: by the clock, so that a busy machine misses.

"""


def add_parser(kinds):
    """Add the subcommand."""
    bounded = kinds.add_parser(
        'bounded', help='what garbage costs beside scans; budgets; exit code 1 if one is missed'
    )
    add_output_options(bounded)
    bounded.set_defaults(run=_bounded)


def _bounded(args):
    from benchmarks.bounded import measure
    from benchmarks.goal import goals_table

    check_outputs(args)
    costs, budgets = measure(args.quick, progress)
    text = f'{TEXT}{goals_table(costs)}\n{goals_table(budgets)}'
    text += QUICK.format('small clouds and one budget') * args.quick
    goals = [*costs, *budgets]
    write(args, {'goals': [goal.record() for goal in goals]}, text)
    print(text)
    return OK if all(goal.reached for goal in goals) else FAILED
