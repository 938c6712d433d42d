"""The node that registers: from its start to its end, or as a lifecycle manager leads it."""

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node

from idem_ros.core import IdemError
from idem_ros.node.live_registration import LiveRegistration
from idem_ros.node.ports import domain_of, no_dead_ports
from idem_ros.terminal.printable import counted, error_line

NAME = 'idem_node'
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class _Registering(Node):
    """A node with a `LiveRegistration`, which is closed before it is destroyed.

    Args:
        node_options: as `rclpy.node.Node` takes them.

    Raises:
        InvalidConfig: a parameter it was started with cannot be used.
    """

    def __init__(self, **node_options):
        with no_dead_ports(domain_of(node_options.get('context'))):
            super().__init__(NAME, **node_options)
        self.registration = LiveRegistration(self)

    def destroy_node(self):
        """Let the refinement under way end, join the worker, and destroy the node."""
        self.registration.close()
        super().destroy_node()


class RegistrationNode(_Registering):
    """Registers as soon as it is made, until it is destroyed; see `_Registering`."""

    def __init__(self, **node_options):
        super().__init__(**node_options)
        try:
            self.registration.open()
            self.registration.start()
        except Exception:
            self.destroy_node()  # at once: who waits for the garbage leaves its ports behind
            raise


class LifecycleRegistrationNode(_Registering, LifecycleNode):
    """The same registration as `RegistrationNode` has, led by a lifecycle manager.

    Configured, it listens to targets and guesses, so that a map is there when it is activated;
    only active does it listen to sources and publish. What waits when it is deactivated is
    dropped and counted, what is under way is published first. Cleaned up, it has forgotten all
    but its parameters and its counts; see `_Registering`.
    """

    def __init__(self, **node_options):
        super().__init__(**node_options)
        self.get_logger().info('unconfigured: waits for a lifecycle manager')

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make publishers and services, compile, and listen to targets and guesses."""
        return self._led(self.registration.open, self.registration.close)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Listen to sources, refine and publish."""
        return self._led(self.registration.start, self.registration.stop)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Publish what is under way, and nothing more."""
        before = self.registration.dropped
        self.registration.stop()
        if dropped := self.registration.dropped - before:
            self.get_logger().info(f'deactivated: dropped {counted(dropped, "waiting source")}')
        return SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let go of publishers, services and what was received."""
        self.registration.close()
        return SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop and let go of everything, whatever the state."""
        self.registration.close()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin anew, unconfigured."""
        self.registration.close()
        return SUCCESS

    def _led(self, begin, undo) -> TransitionCallbackReturn:
        try:
            begin()
        except (IdemError, RuntimeError) as error:  # of rclpy: a topic of another type, ...
            self.get_logger().error(error_line(error))
            undo()
            return FAILURE
        return SUCCESS
