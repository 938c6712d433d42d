"""The parameters of a node as configurations, while it runs."""

from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node

from idem_ros.core import IdemError
from idem_ros.node.interface import CONFIGS
from idem_ros.node.parameters import declare_parameters, read_config, unknown_parameters


class LiveParameters:
    """Declares a node's parameters, refuses those that cannot be used, and tells of changes.

    Args:
        node: its parameters.
        on_change: called with {type: configuration} after each change.
        require: raises IdemError where configurations cannot be used together.
        configs: the types of the configurations.
        without: names of fields that the node decides itself.

    Raises:
        InvalidConfig: a parameter that the node was started with cannot be used.
    """

    def __init__(
        self,
        node: Node,
        on_change: Callable[[dict[type, Any]], None],
        require: Callable[[dict[type, Any]], None],
        configs: Iterable[type] = CONFIGS,
        without: Iterable[str] = (),
    ):
        self._node, self._on_change = node, on_change
        self._require, self._configs = require, configs
        declare_parameters(node, configs, without)
        if unknown := unknown_parameters(node):  # a file of parameters may be other nodes', too
            node.get_logger().warning(f'no parameter of this node: {", ".join(unknown)}')
        self._require(self.read())
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._tell)

    def read(self, changed=()) -> dict[type, Any]:
        """Return {type: configuration}, with parameters about to be set in place of the node's.

        Raises:
            InvalidConfig: one of them cannot be used.
        """
        return {kind: read_config(self._node, kind, changed) for kind in self._configs}

    def _check(self, changed) -> SetParametersResult:
        try:
            self._require(self.read(changed))
        except IdemError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _tell(self, changed) -> None:
        for each in changed:
            self._node.get_logger().info(f'{each.name} is {each.value!r} from now on')
        self._on_change(self.read())
