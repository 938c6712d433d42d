"""The fields of the two configurations as declared ROS parameters, and back again."""

from collections.abc import Iterable
from dataclasses import Field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.node.interface import default_of, description_of, parameter_fields
from idem_ros.node.subscription_config import SubscriptionConfig

Config = TypeVar('Config', RegistrationConfig, SubscriptionConfig)


def declare_parameters(node: Node) -> None:
    """Declare a parameter for every field of both configurations, with its description.

    The registration's parameters may be changed while the node runs; the subscriptions' are
    read-only. Typing is dynamic so that `a:=2` serves where 2.0 is meant; `read_config` refuses
    what does not fit.
    """
    read_only = {field.name for field in fields(SubscriptionConfig)}
    for field in parameter_fields():
        descriptor = ParameterDescriptor(
            description=description_of(field),
            read_only=field.name in read_only,
            dynamic_typing=True,
        )
        node.declare_parameter(field.name, default_of(field), descriptor)


def read_config(
    node: Node, config_type: type[Config], changed: Iterable[Parameter] = ()
) -> Config:
    """Build a configuration from the node's parameters.

    Args:
        node: one on which `declare_parameters` was called.
        config_type: which of the two configurations.
        changed: parameters about to be set, which take the place of the node's own.

    Raises:
        InvalidConfig: a value outside its range or of another type; says what would be right.
    """
    values = {parameter.name: parameter.value for parameter in changed}
    for field in fields(config_type):
        if field.name not in values:
            values[field.name] = node.get_parameter(field.name).value
    return config_type(**{f.name: _from_ros(f, values[f.name]) for f in fields(config_type)})


def _from_ros(field: Field, value: Any) -> Any:
    if isinstance(field.default, tuple):
        if isinstance(value, (str, bytes)) or not hasattr(value, '__iter__'):
            raise InvalidConfig(f'{field.name} is {value!r}; it must be a list of numbers')
        return tuple(_as_float(item) for item in value)
    if field.default is None and not isinstance(value, bool) and value == 0:
        return None
    return _as_float(value) if isinstance(field.default, (float, type(None))) else value


def _as_float(value: Any) -> Any:
    """Return a whole number as a float; leave everything else for the configuration to judge."""
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if is_whole else value
