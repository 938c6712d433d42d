"""The parameters of a node as configurations, while it runs."""

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node

from idem_ros.core import IdemError
from idem_ros.node.interface import CONFIGS
from idem_ros.node.output_config import OutputConfig
from idem_ros.node.outputs import require_outputs
from idem_ros.node.parameters import declare_parameters, read_config, unknown_parameters
from idem_ros.node.subscriptions import require_messages
from idem_ros.pairing.guesses import GuessConfig


class LiveParameters:
    """Declares a node's parameters, refuses those that cannot be used, and tells of changes.

    Args:
        node: its parameters.
        on_change: called with {type: configuration} after each change.

    Raises:
        InvalidConfig: a parameter that the node was started with cannot be used.
    """

    def __init__(self, node: Node, on_change: Callable[[dict[type, Any]], None]):
        self._node, self._on_change = node, on_change
        declare_parameters(node)
        if unknown := unknown_parameters(node):  # a file of parameters may be other nodes', too
            node.get_logger().warning(f'no parameter of this node: {", ".join(unknown)}')
        self._require_usable()
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._tell)

    def read(self, changed=()) -> dict[type, Any]:
        """Return {type: configuration}, with parameters about to be set in place of the node's.

        Raises:
            InvalidConfig: one of them cannot be used.
        """
        return {kind: read_config(self._node, kind, changed) for kind in CONFIGS}

    def _require_usable(self, changed=()) -> None:
        configs = self.read(changed)
        require_messages(configs[GuessConfig].type)
        require_outputs(configs[OutputConfig])

    def _check(self, changed) -> SetParametersResult:
        try:
            self._require_usable(changed)
        except IdemError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _tell(self, changed) -> None:
        for each in changed:
            self._node.get_logger().info(f'{each.name} is {each.value!r} from now on')
        self._on_change(self.read())
