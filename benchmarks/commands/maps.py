"""`python -m benchmarks maps`: a scan in maps of 0.2 to 50 million points."""

from dataclasses import replace

from benchmarks.commands.outputs import (
    QUICK,
    add_output_options,
    check_outputs,
    write,
)
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.terminal.command_line import FAILED, OK, progress


def add_parser(kinds, own):
    """Add the subcommand; own: the parameters that the benchmark sets itself."""
    maps = kinds.add_parser(
        'maps',
        help='cost, error and verdict of scans in maps of 0.2 to 50 million points, beside GICP; '
        'exit code 1 if a figure is missed',
        description='Register simulated scans in maps of a town, and drive through one of them. '
        'Five minutes on two cores, 4 GB (of which small_gicp takes most).',
    )
    add_output_options(maps)
    add_config_options(maps, without=own)
    maps.set_defaults(run=_maps)


def _maps(args):
    from benchmarks.goal import goals_table
    from benchmarks.maps.measure import goals, measure
    from benchmarks.maps.report import json_record, markdown
    from idem_ros.replay.peers import small_gicp

    check_outputs(args)
    small_gicp()
    config = replace(config_from(args), assessment='verdict')  # as the node has it
    found = measure(config, args.quick, progress)
    text = markdown(*found) + QUICK.format('two small maps and few scans') * args.quick
    write(args, json_record(*found), text)
    reached = [*goals(*found)]
    print(goals_table(reached) if args.markdown else text)
    return OK if all(goal.reached for goal in reached) else FAILED
