"""The node that registers from its start to its end."""

from rclpy.node import Node

from idem_ros.node.dead_ports import domain_of, no_dead_ports
from idem_ros.node.live_registration import LiveRegistration

NAME = 'idem_node'


class RegistrationNode(Node):
    """Registers as soon as it is made, until it is destroyed; see `LiveRegistration`.

    Args:
        node_options: as `rclpy.node.Node` takes them.

    Raises:
        InvalidConfig: a parameter it was started with cannot be used.
    """

    def __init__(self, **node_options):
        with no_dead_ports(domain_of(node_options.get('context'))):
            super().__init__(NAME, **node_options)
        self.registration = LiveRegistration(self)
        try:
            self.registration.open()
            self.registration.start()
        except Exception:
            self.destroy_node()  # at once: who waits for the garbage leaves its ports behind
            raise

    def destroy_node(self):
        """Let the refinement under way end, join the worker, and destroy the node."""
        self.registration.close()
        super().destroy_node()
