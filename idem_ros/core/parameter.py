"""Parameters: fields of frozen dataclasses that say what they are, and what they must be."""

import math
from dataclasses import Field, field, fields
from typing import Any, cast, get_args

import numpy as np

from idem_ros.core.exceptions import InvalidConfig


def parameter(default: Any, description: str, unit: str = '', **metadata: Any) -> Any:
    """Return a dataclass field that is a parameter.

    Args:
        default: its value where nobody says otherwise.
        description: what it is, in a sentence.
        unit: such as 'm'; empty where it has none.
        **metadata: `name` where it is not the field's own, `range` as (lowest, highest) of a
            number, `choices` of a word, `words` that stand beside numbers, `fixed` where it
            cannot change while the node runs.
    """
    return field(default=default, metadata={'description': description, 'unit': unit, **metadata})


def parameter_name(each: Field[Any]) -> str:
    """Return the name of the parameter behind a field, as ROS spells it: 'initial_guess.type'."""
    return each.metadata.get('name', each.name)


def is_optional(each: Field[Any]) -> bool:
    """Return whether a field may be None, which ROS cannot hold and says as 0."""
    return each.default is None or type(None) in _types(each)


def is_whole(each: Field[Any]) -> bool:
    """Return whether a field is a whole number, or None."""
    return int in _types(each) or type(each.default) is int


def require_fields(config: Any) -> None:
    """Refuse a value that is not what its field says; one of NumPy's becomes Python's.

    A number is in its `range`, or above 0 where it has none; a word is one of its `choices`.
    What is in a list is the configuration's own to judge.

    Raises:
        InvalidConfig: it names the parameter and the value.
    """
    for each in fields(config):
        value = plain(getattr(config, each.name))
        object.__setattr__(config, each.name, value)  # a kernel is compiled anew for NumPy's type
        if value is not None or not is_optional(each):
            _require(each, value)


def _require(each: Field[Any], value: Any) -> None:
    name, types, words = parameter_name(each), _types(each), each.metadata.get('words', ())
    if isinstance(value, str) and value in words:
        return
    if 'choices' in each.metadata:
        require_one_of(name, value, each.metadata['choices'])
    elif 'range' in each.metadata:
        require_within(name, value, each.metadata['range'], is_whole(each), words)
    elif isinstance(each.default, tuple):
        is_list = hasattr(value, '__iter__') and not isinstance(value, str)
        _refuse_unless(is_list, name, value, 'a list')
    elif isinstance(each.default, bool):
        _refuse_unless(isinstance(value, bool), name, value, 'true or false')
    elif isinstance(each.default, str):
        _refuse_unless(isinstance(value, str), name, value, 'a text')
    else:
        (require_count if int in types else require_positive)(name, value)


def require_positive(name: str, value: Any) -> None:
    """Refuse what is no finite number above 0; see `require_fields`."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    is_right = is_number and math.isfinite(value) and value > 0
    _refuse_unless(is_right, name, value, 'a finite number above 0')


def require_count(name: str, value: Any) -> None:
    """Refuse what is no whole number from 1; see `require_fields`."""
    is_right = isinstance(value, int) and not isinstance(value, bool) and value >= 1
    _refuse_unless(is_right, name, value, 'a whole number from 1')


def require_one_of(name: str, value: Any, words: tuple[str | None, ...]) -> None:
    """Refuse what is none of the words; see `require_fields`."""
    _refuse_unless(value in words, name, value, f'one of {words}')


def require_within(
    name: str,
    value: Any,
    limits: tuple[float, float],
    is_whole: bool = False,
    words: tuple[str, ...] = (),
) -> None:
    """Refuse what is no number from the lowest to the highest; see `require_fields`."""
    low, high = limits
    types = int if is_whole else (int, float)
    is_number = isinstance(value, types) and not isinstance(value, bool)
    kind = 'whole number' if is_whole else 'number'
    right = ' or '.join([f'a {kind} from {low:g} to {high:g}', *map(repr, words)])
    _refuse_unless(is_number and low <= value <= high, name, value, right)


def _refuse_unless(is_right: bool, name: str, value: Any, right: str) -> None:
    if not is_right:
        raise InvalidConfig(f'{name} is {value!r}; it must be {right}')


def plain(value: Any) -> Any:
    """Return a NumPy scalar as Python's."""
    return cast(Any, value).item() if isinstance(value, np.generic) else value


def _types(each: Field[Any]) -> set[Any]:
    return set(get_args(each.type)) or {each.type}
