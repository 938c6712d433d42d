"""What a field of a configuration says of itself: its name, default, unit and range.

Configurations are frozen dataclasses; node, command line, `config/refine.yaml` and documents all
derive their parameters from the fields by these functions, so that each is described once.
"""

import math
from dataclasses import Field
from typing import Any, get_args

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import is_optional, is_whole, parameter_name

LARGEST_INT = 2**31 - 1


def is_real(each: Field) -> bool:
    """Return whether a field is a number that need not be whole, or else None or a word."""
    return isinstance(default_of(each), float) or float in get_args(each.type)


def default_of(each: Field) -> Any:
    """Return a field's default as ROS can hold it: a list for a tuple, 0 for None."""
    if each.default is None:
        return 0 if is_whole(each) else 0.0
    return list(each.default) if isinstance(each.default, tuple) else each.default


def description_of(each: Field) -> str:
    """Return a field's description with its unit, and with what 0 means where that is none."""
    unit = f' [{each.metadata["unit"]}]' if each.metadata['unit'] else ''
    none = f'; {0 if is_whole(each) else 0.0} means none' if is_optional(each) else ''
    return f'{each.metadata["description"]}{unit}{none}'


def range_of(each: Field) -> tuple | None:
    """Return the (lowest, highest) value of a number; None for what is no single number.

    Where a field names none: no number here is negative, and whole ones count from 1.
    """
    default = default_of(each)
    if isinstance(default, bool) or not isinstance(default, (int, float)):
        return None
    if 'range' in each.metadata:
        return each.metadata['range']
    if isinstance(default, int):
        return (0 if is_optional(each) else 1, LARGEST_INT)
    return (0.0, math.inf)


def value_of(each: Field, given: Any) -> Any:
    """Return a field's value as given by ROS: a tuple of a list, None of 0, 2.0 of 2.

    Raises:
        InvalidConfig: no list where one is meant; everything else is the configuration's to judge.
    """
    if isinstance(each.default, tuple):
        if isinstance(given, (str, bytes)) or not hasattr(given, '__iter__'):
            raise InvalidConfig(
                f'{parameter_name(each)} is {given!r}; it must be a list of numbers'
            )
        return tuple(_as_float(item) for item in given)
    is_number = not isinstance(given, bool)
    if is_optional(each) and is_number and given == 0:
        return None
    return _as_float(given) if is_real(each) else given


def _as_float(value: Any) -> Any:
    """Return a whole number as a float; leave everything else for the configuration to judge."""
    is_whole_number = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if is_whole_number else value
