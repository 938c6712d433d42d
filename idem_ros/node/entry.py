"""Run a node as a process: `ros2 run idem_ros idem_node`, or one of the others."""

import argparse
import gc
import sys
from contextlib import suppress

from idem_ros.node.allocation import keep_freed_memory, take_small_pages
from idem_ros.node.environment import RclpyMissing, require_rclpy
from idem_ros.node.process import AskedToEnd, is_asked_for, leave, note_signals
from idem_ros.terminal.command_line import CommandLine
from idem_ros.terminal.printable import error_line

FAILED = 1
USAGE_ERROR = 2
LONGEST_WAIT = 0.1  # [s] from a signal to the end of an idle node
SWITCH = 5e-4  # [s] that the worker waits for the interpreter, at most: it asks at every kernel
ONE, MANAGED, RIG = 'idem_node', 'idem_lifecycle_node', 'idem_rig_node'
REFINES = (
    'Refine the pose of a source cloud in a target cloud, live, from an initial guess. '
    'Topics are remapped and parameters set with --ros-args, such as: '
    '--ros-args -r ~/source:=/lidar/points -p voxel_size:=0.5'
)
DESCRIPTIONS = {
    ONE: REFINES,
    MANAGED: REFINES,
    RIG: 'Watch the LiDARs of a rig, and warn where one is no longer where it was calibrated: '
    '--ros-args -p extrinsics:=rig/extrinsics.yaml -p topics:="[/top/points, /left/points]"',
}


def main(args: list[str] | None = None, name: str = ONE) -> int:
    """Run a node until SIGINT or SIGTERM; one may come while kernels are compiled, too.

    Args:
        args: command line with the program's name; None for that of the process.
        name: of the program, which says what node it is.

    Returns:
        0; 1 where there is no rclpy, 2 where an argument or a parameter cannot be used (one line
        on stderr says why).
    """
    note_signals()
    keep_freed_memory()
    take_small_pages()
    try:
        require_rclpy(name)
    except RclpyMissing as error:
        return _said(name, error, FAILED)
    return leave(_run(args, name))


def main_managed(args: list[str] | None = None) -> int:
    """Run the node as a managed one, see `main`."""
    return main(args, MANAGED)


def main_rig(args: list[str] | None = None) -> int:
    """Run the node that watches a rig, see `main`."""
    return main(args, RIG)


def _run(args: list[str] | None, name: str) -> int:
    # late, with the handlers in place: importing and compiling take seconds
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.signals import SignalHandlerOptions

    from idem_ros.core import IdemError
    from idem_ros.node.environment import logging_arguments, prefer_short_lease
    from idem_ros.node.ignored_arguments import warn_of_ignored

    node = None
    try:
        find = _own_arguments(args, name)
        args = [*(sys.argv if args is None else args), *logging_arguments()]
        prefer_short_lease()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        if find is not None:
            return _find(find)
        while not is_asked_for():
            node = _node_class(name)()
            warn_of_ignored(node, args)
            _spin(node)
    except AskedToEnd:
        return 0
    except (IdemError, RuntimeError, NameValidationException) as error:
        if node is not None:
            raise
        return _said(name, error, USAGE_ERROR)
    finally:
        rclpy.try_shutdown()  # pyright: ignore[reportPrivateImportUsage]
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
    sys.setswitchinterval(SWITCH)
    executor.add_node(node)
    gc.collect()
    gc.freeze()  # else each full collection looks at all that was imported: a scan waits 50 ms
    try:
        while not is_asked_for():
            _turn(executor, node)
    except PortLost as error:
        node.get_logger().error(f'{error}; the node begins anew')
    finally:
        executor.remove_node(node)
        node.destroy_node()


def _turn(executor, node) -> None:
    """Have an executor take what is due; an error that nobody foresaw does not end the node."""
    from idem_ros.node.hearing import PortLost
    from idem_ros.node.unforeseen import AGAIN, reason_of

    try:
        executor.spin_once(timeout_sec=LONGEST_WAIT)
    except PortLost:
        raise
    except Exception as error:
        if not node.context.ok():
            raise
        log = node.get_logger()
        log.error(f'an input is lost: {reason_of(error, log)}', throttle_duration_sec=AGAIN)


def _node_class(name: str) -> type:
    if name == RIG:
        from idem_ros.node.rig_node import RigNode

        return RigNode
    if name == MANAGED:
        from idem_ros.node.registration_node import LifecycleRegistrationNode

        return LifecycleRegistrationNode
    from idem_ros.node.registration_node import RegistrationNode

    return RegistrationNode


def _own_arguments(args: list[str] | None, name: str) -> float | None:
    """Return for how long to listen [s] to what is on the graph; None: it is not asked for."""
    from rclpy.utilities import remove_ros_args

    parser = CommandLine(name, description=DESCRIPTIONS[name])
    parser.set_defaults(find=None)
    if name != RIG:
        parser.add_argument(
            '--find',
            metavar='SECONDS',
            nargs='?',
            type=_seconds,
            const=3.0,
            help='listen for so long (default: 3), list the clouds, poses and tf on the graph '
            'with their rates and frames, and propose a command line; nothing is refined',
        )
    return parser.parse_args(remove_ros_args(args)[1:]).find


def _seconds(text: str) -> float:
    with suppress(ValueError):
        if 0.0 < (seconds := float(text)) <= 3600.0:
            return seconds
    raise argparse.ArgumentTypeError(f'{text!r} is no time above 0 and up to an hour, in seconds')


def _said(name: str, error: Exception, code: int) -> int:
    reason = error_line(error).split(', at /')[0]  # rcl appends its source lines
    print(f'{name}: error: {reason}', file=sys.stderr)
    return code


if __name__ == '__main__':
    sys.exit(main())
