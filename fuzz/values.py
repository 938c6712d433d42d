"""What no field expects, and what becomes of records and bytes that chance has spoilt."""

import copy

HOSTILE = [
    None,
    True,
    False,
    0,
    -1,
    1,
    7,
    0.5,
    2**31,
    2**53,
    2**63 - 1,
    -(2**62),
    2**70,
    1e300,
    -1e99,
    1e99,
    1e-320,
    float('nan'),
    float('inf'),
    '',
    'x',
    '\0',
    '../../etc/passwd',
    '/dev/zero',
    '/dev/stdin',
    'a' * 5000,
    '\ud800',
    '=1+1',
    '\x1b[31m',
    '\n',
    '\u202e',
    'nan',
    '1e5',
    'none',
    [],
    [[]],
    [None] * 4,
    [1, 2],
    {},
    {'a': {'b': 1}},
    [[1.0] * 4] * 4,
    [[float('nan')] * 4] * 4,
]
EXTREMES = [
    0,
    1,
    255,
    2**15,
    2**16 - 1,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**40,
    2**63,
    2**64 - 1,
]


def chance(rng, *choices):
    """Return one of the choices."""
    return choices[rng.randrange(len(choices))]


def spoilt_record(rng, record):
    """Return a copy of nested lists and mappings in which one to three places are others."""
    record = copy.deepcopy(record)
    for _ in range(chance(rng, 1, 1, 1, 2, 3)):
        if not record:
            break
        inner, key = _place(rng, record)
        how = rng.random()
        if how < 0.1:
            del inner[key]
        elif how < 0.15 and isinstance(inner, dict):
            inner[chance(rng, '\x1b=evil', '', 'x' * 300, '__class__')] = inner.pop(key)
        elif how < 0.2:
            inner[key] = _nested(rng, inner[key])
        elif how < 0.3 and isinstance(inner[key], float | int):
            inner[key] = inner[key] * chance(rng, -1, 0, 1e3, 1e12, 1e-9)
        else:
            inner[key] = copy.deepcopy(chance(rng, *HOSTILE))
    return record


def spoilt_bytes(rng, content):
    """Return bytes with one to four faults."""
    content = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at, how = rng.randrange(len(content) or 1), rng.random()
        if how < 0.35 and content:
            content[at] = rng.randrange(256)
        elif how < 0.65:
            size = chance(rng, 1, 2, 4, 8)
            number = chance(rng, *EXTREMES) % 256**size
            content[at : at + size] = number.to_bytes(size, 'little')
        elif how < 0.75:
            del content[at:]
        elif how < 0.85:
            del content[at : at + rng.randint(1, 64)]
        elif how < 0.95:
            begin = rng.randrange(len(content) or 1)
            content[at:at] = content[begin : begin + rng.randint(1, 256)]
        else:
            content[at : at + 16] = rng.randbytes(16)
    return bytes(content)


def _place(rng, record):
    """Return (list or mapping, key) of a place; deep ones are as likely as shallow ones."""
    inner = record
    while True:
        keys = list(inner) if isinstance(inner, dict) else range(len(inner))
        key = chance(rng, *keys)
        if not (isinstance(inner[key], dict | list) and inner[key]) or rng.random() < 0.2:
            return inner, key
        inner = inner[key]


def _nested(rng, value):
    for _ in range(chance(rng, 1, 5, 30, 150)):
        value = [value]
    return value
