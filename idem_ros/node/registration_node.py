"""Run the node as a process: `ros2 run idem_ros idem_node`, or `idem_lifecycle_node`."""

import argparse
import sys
from contextlib import suppress
from itertools import pairwise

from idem_ros.node.ending import AskedToEnd, is_asked_for, leave, note_signals
from idem_ros.node.rclpy_needed import RclpyMissing, require_rclpy
from idem_ros.terminal.command_line import CommandLine

FAILED = 1
USAGE_ERROR = 2
LONGEST_WAIT = 0.1  # [s] from a signal to the end of an idle node
DESCRIPTION = (
    'Refine the pose of a source cloud in a target cloud, live, from an initial guess. '
    'Topics are remapped and parameters set with --ros-args, such as: '
    '--ros-args -r ~/source:=/lidar/points -p voxel_size:=0.5'
)


def main(args: list[str] | None = None, is_managed: bool = False) -> int:
    """Refine clouds until SIGINT or SIGTERM; one may come while kernels are compiled, too.

    Args:
        args: command line with the program's name; None for that of the process.
        is_managed: whether a lifecycle manager says when it refines, rather than from the start.

    Returns:
        0; 1 where there is no rclpy, 2 where an argument or a parameter cannot be used (one line
        on stderr says why).
    """
    note_signals()
    try:
        require_rclpy('idem_lifecycle_node' if is_managed else 'idem_node')
    except RclpyMissing as error:
        return _said(error, FAILED)
    return leave(_run(args, is_managed))


def main_managed(args: list[str] | None = None) -> int:
    """Run the node as a managed one, see `main`."""
    return main(args, is_managed=True)


def _run(args: list[str] | None, is_managed: bool) -> int:
    # late, with the handlers in place: importing and compiling take seconds
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.signals import SignalHandlerOptions

    from idem_ros.core import IdemError
    from idem_ros.node.log_folder import logging_arguments
    from idem_ros.node.short_lease import prefer_short_lease

    node = None
    try:
        own = _own_arguments(args)
        args = [*(sys.argv if args is None else args), *logging_arguments()]
        prefer_short_lease()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        if own.find is not None:
            return _find(own.find)
        while not is_asked_for():
            node = _node_class(is_managed)()
            _name_other_nodes(node, args)
            _spin(node)
    except AskedToEnd:
        return 0
    except (IdemError, RuntimeError, NameValidationException) as error:
        if node is not None:
            raise
        return _said(error, USAGE_ERROR)
    finally:
        rclpy.try_shutdown()
    return 0


def _find(seconds: float) -> int:
    from rclpy.node import Node

    from idem_ros.node.find import find, proposal, told

    node = Node('idem_find')
    try:
        heard = find(node, seconds)
    finally:
        node.destroy_node()
    with suppress(BrokenPipeError):  # the reader of our output went away: `... | head`
        print(told(heard, seconds), flush=True)
    return 0 if proposal(heard) else FAILED


def _spin(node) -> None:
    """Serve a node until the process is asked to end, or the node must be made anew."""
    from rclpy.executors import SingleThreadedExecutor

    from idem_ros.node.hearing import PortLost

    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not is_asked_for():
            executor.spin_once(timeout_sec=LONGEST_WAIT)
    except PortLost as error:
        node.get_logger().error(f'{error}; the node begins anew')
    finally:
        executor.remove_node(node)
        node.destroy_node()


def _node_class(is_managed: bool) -> type:
    if is_managed:
        from idem_ros.node.lifecycle_node import LifecycleRegistrationNode

        return LifecycleRegistrationNode
    from idem_ros.node.adapter import RegistrationNode

    return RegistrationNode


def _name_other_nodes(node, args: list[str]) -> None:
    """Warn of parameter files that speak to other nodes only: ROS ignores them without a word."""
    from idem_ros.core import IdemError
    from idem_ros.parameters.parameter_file import read_sections, speaks_to

    this = node.get_fully_qualified_name()
    for path in [path for option, path in pairwise(args) if option == '--params-file']:
        with suppress(IdemError):  # ROS took it: it is for it to judge
            names = [name for name, _ in read_sections(path)]
            if not any(speaks_to(name, this) for name in names):
                node.get_logger().warning(
                    f'{path} speaks to {", ".join(names) or "nobody"}; this is {this}: nothing of '
                    'it is taken'
                )


def _own_arguments(args: list[str] | None) -> argparse.Namespace:
    from rclpy.utilities import remove_ros_args

    parser = CommandLine('idem_node', description=DESCRIPTION)
    parser.add_argument(
        '--find',
        metavar='SECONDS',
        nargs='?',
        type=_seconds,
        const=3.0,
        help='listen for so long (default: 3), list the clouds, poses and tf on the graph with '
        'their rates and frames, and propose a command line; nothing is refined',
    )
    return parser.parse_args(remove_ros_args(args)[1:])


def _seconds(text: str) -> float:
    with suppress(ValueError):
        if 0.0 < (seconds := float(text)) <= 3600.0:
            return seconds
    raise argparse.ArgumentTypeError(f'{text!r} is no time above 0 and up to an hour, in seconds')


def _said(error: Exception, code: int) -> int:
    reason = ' '.join(str(error).split()).split(', at /')[0]  # rcl appends its source lines
    print(f'idem_node: error: {reason}', file=sys.stderr)
    return code


if __name__ == '__main__':
    sys.exit(main())
