"""The fields of the configurations as declared ROS parameters, and back again."""

from collections.abc import Iterable
from dataclasses import Field, fields
from difflib import get_close_matches
from typing import TYPE_CHECKING, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import is_whole, parameter_name
from idem_ros.node.interface import CONFIGS
from idem_ros.parameters.fields import (
    default_of,
    description_of,
    range_of,
    value_of,
)

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult

from idem_ros.core import IdemError

Config = TypeVar('Config', bound='DataclassInstance')


def declare_parameters(
    node: Node, configs: Iterable[type] = CONFIGS, without: Iterable[str] = ()
) -> None:
    """Declare a parameter for every field of the configurations, with description and range.

    Those marked as fixed are read-only, the others may be changed while the node runs. Typing is
    dynamic so that `a:=2` serves where 2.0 is meant; `read_config` refuses what does not fit.

    Args:
        node: their node.
        configs: the types of the configurations.
        without: names of fields that the node decides itself.

    Raises:
        InvalidConfig: the node was started with a value out of range.
    """
    for config_type in configs:
        for field in fields(config_type):
            if field.name in without:
                continue
            name, default = parameter_name(field), default_of(field)
            try:
                node.declare_parameter(name, default, _descriptor(field))
            except InvalidParameterValueException as error:
                # rclpy says neither which range nor of what; the configuration does
                anything = ParameterDescriptor(dynamic_typing=True)
                given = node.declare_parameter(name, default, anything)
                config_type(**{field.name: value_of(field, given.value)})
                raise InvalidConfig(f'{name}: {error}') from error


def unknown_parameters(node: Node) -> list[str]:
    """Name what the node was started with that is no parameter of it, and what may be meant."""
    known = list(node.get_parameters_by_prefix(''))
    said = []
    for name in node._parameter_overrides:  # rclpy has no public way to ask
        if not node.has_parameter(name) and not name.startswith('qos_overrides.'):
            close = get_close_matches(name, known, 1)
            said.append(name + (f' ({close[0]}?)' if close else ''))
    return said


def read_config(
    node: Node, config_type: type[Config], changed: Iterable[Parameter] = ()
) -> Config:
    """Build a configuration from the node's parameters.

    Args:
        node: one on which `declare_parameters` was called.
        config_type: which of those that were declared.
        changed: parameters about to be set, which take the place of the node's own.

    Raises:
        InvalidConfig: a value outside its range or of another type; says what would be right.
    """
    about_to_be = {parameter.name: parameter.value for parameter in changed}
    values = {}
    for field in fields(config_type):
        name = parameter_name(field)
        if not node.has_parameter(name):  # the node decides it itself
            continue
        value = about_to_be[name] if name in about_to_be else node.get_parameter(name).value
        values[field.name] = value_of(field, value)
    return config_type(**values)


def _descriptor(field: Field) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=description_of(field),
        additional_constraints='one of ' + ', '.join(field.metadata['choices'])
        if 'choices' in field.metadata
        else '',
        read_only=field.metadata.get('fixed', False),
        dynamic_typing=True,
    )
    if (limits := range_of(field)) is not None:
        if is_whole(field):
            descriptor.integer_range = [IntegerRange(from_value=limits[0], to_value=limits[1])]
        else:
            low, high = map(float, limits)
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return descriptor


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
            _refuse_deletion(changed)
            self._require(self.read(changed))
        except IdemError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _tell(self, changed) -> None:
        for each in changed:
            self._node.get_logger().info(f'{each.name} is {each.value!r} from now on')
        self._on_change(self.read())


def _refuse_deletion(changed: Iterable[Parameter]) -> None:
    names = [each.name for each in changed if each.type_ is Parameter.Type.NOT_SET]
    if names:
        raise InvalidConfig(
            f'{", ".join(names)} cannot be deleted; a number of which 0 means none is set to 0'
        )
