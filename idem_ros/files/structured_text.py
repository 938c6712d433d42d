"""YAML and JSON of anybody's, read in bounded time, memory and depth; plain values only."""

import json
import math
import os
from pathlib import Path
from typing import Any

import yaml

from idem_ros.core.exceptions import IdemError
from idem_ros.terminal.printable import error_line

MOST_YAML = 2**18  # [bytes]; what people write by hand is a hundredth of it
MOST_VALUES = 20_000  # in a YAML, each as often as aliases repeat it
DEEPEST = 40  # lists and mappings within each other
LARGEST_INT = 2**63
Loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class UnreadableText(IdemError):
    """A file that is not there, or no YAML or JSON of a size that can be meant."""


def read_yaml(path, most_bytes=MOST_YAML, most_values=MOST_VALUES) -> Any:
    """Read a file of YAML 1.1 without tags of Python's.

    Args:
        path: the file.
        most_bytes, most_values: what it may hold; more than people write by hand, a program does.

    Returns:
        None, bool, int of 64 bits, float, str, date, list and dict with keys of text; what an
        alias repeats is one object.

    Raises:
        UnreadableText: in one line: no such file, no YAML, or one that says a name twice, holds
            itself, or is larger or deeper than anything that people write.
    """
    try:
        text = _at_most(path, most_bytes).decode('utf-8')
        _require_bounded(yaml.parse(text, Loader), most_values)
        return _checked(yaml.load(text, _OnceNamed))
    except OSError as error:
        raise UnreadableText(f'{path} cannot be read: {error.strerror or error}') from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise UnreadableText(f'{path} is no YAML: {error_line(error)}') from error


def parse_json(text):
    """Return what bytes of JSON hold: finite numbers, integers of 64 bits, each name once.

    Raises:
        ValueError: it is no such JSON; the message is one line.
    """
    try:
        value = json.loads(
            text.decode('utf-8'),
            parse_constant=_refuse,
            parse_int=_integer,
            parse_float=_finite,
            object_pairs_hook=_once_named,
        )
        _require_shallow([value])
        return value
    except RecursionError as error:
        raise ValueError(f'it is deeper than {DEEPEST} lists and records') from error


class _OnceNamed(Loader):  # pyright: ignore[reportGeneralTypeIssues]
    """Refuses a mapping that says a name twice, where YAML forgets the first."""

    def construct_mapping(self, node, deep=False):
        said = [key.value for key, _ in node.value if key.id == 'scalar']
        if len(said) < len(node.value):
            raise yaml.YAMLError('a name is a list or a mapping; it must be a word')
        if len(set(said)) < len(said):
            raise yaml.YAMLError(f'{_repeated(said)[:60]!r} is said twice')
        return super().construct_mapping(node, deep)


def _at_most(path, most):
    # not blocking: a FIFO that nobody writes to is empty, and does not wait for ever
    descriptor = os.open(Path(path), os.O_RDONLY | os.O_NONBLOCK)
    with os.fdopen(descriptor, 'rb') as stream:
        os.set_blocking(descriptor, True)
        content = stream.read(most + 1)
    if len(content) > most:
        raise ValueError(f'it is larger than {most} bytes')
    return content


def _require_bounded(events, most):
    """Count values as aliases repeat them, before any is made; refuse what holds itself."""
    sizes, open_ = {}, [(None, 0)]
    for event in events:
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, size = open_.pop()
        elif isinstance(event, yaml.CollectionStartEvent):
            if len(open_) > DEEPEST:
                raise ValueError(f'it is deeper than {DEEPEST} lists and mappings')
            open_.append((event.anchor, 1))
            sizes.pop(event.anchor, None)  # known when it ends: until then it would hold itself
            continue
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise ValueError(f'the alias *{event.anchor[:60]} holds itself, or nothing')
            anchor, size = None, sizes[event.anchor]
        elif isinstance(event, yaml.ScalarEvent):
            anchor, size = event.anchor, 1
        else:
            continue
        if anchor is not None:
            sizes[anchor] = size
        outer, count = open_.pop()
        open_.append((outer, count + size))
        if count + size > most:
            raise ValueError(f'it holds more than {most} values')


def _checked(value):
    """Return plain values; refuse names that are no text, and whole numbers that none can hold."""
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise ValueError(f'a name is {str(key)[:60]}; it must be a word')
        return {key: _checked(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_checked(each) for each in value]
    if isinstance(value, int) and not -LARGEST_INT <= value < LARGEST_INT:
        raise ValueError('it holds a whole number of more than 64 bits')
    # a date is a word: no parameter is one
    return value if isinstance(value, str | int | float | None) else str(value)


def _require_shallow(value, depth=0):
    if depth > DEEPEST:
        raise RecursionError
    for each in value.values() if isinstance(value, dict) else value:
        if isinstance(each, list | dict):
            _require_shallow(each, depth + 1)


def _once_named(pairs):
    record = dict(pairs)
    if len(record) < len(pairs):
        raise ValueError(f'{_repeated(name for name, _ in pairs)[:60]!r} is said twice')
    return record


def _repeated(names):
    seen = set()
    return next(name for name in names if name in seen or seen.add(name))


def _finite(digits):
    number = float(digits)
    return number if math.isfinite(number) else _refuse(digits)


def _integer(digits):
    # by its length first: to read a number takes the square of it
    number = int(digits) if len(digits) < 30 else _refuse(digits)
    return number if -LARGEST_INT <= number < LARGEST_INT else _refuse(digits)


def _refuse(digits):
    raise ValueError(f'{digits[:60]} is no number of JSON that can be meant')
