"""The record of a replay as the text of a JSON file, without ever holding all of it."""

from json import JSONEncoder

_encode = JSONEncoder(indent=1, allow_nan=False).encode


def record_text(record):
    """Yield the text of a record piece by piece, as `json.dumps(record, indent=1)` makes it.

    Args:
        record: see `summary.json_record`; its 'frames' are any iterable.

    Raises:
        ValueError: a number is not finite.
    """
    opening = '{'
    for name, value in record.items():
        yield f'{opening}\n {_encode(name)}: '
        yield from _list(value) if name == 'frames' else [_indented(value, 1)]
        opening = ','
    yield '\n}\n'


def _list(values):
    opening = '['
    for value in values:
        yield f'{opening}\n  {_indented(value, 2)}'
        opening = ','
    yield '[]' if opening == '[' else '\n ]'


def _indented(value, depth):
    return _encode(value).replace('\n', '\n' + depth * ' ')  # no string of JSON has a line break
