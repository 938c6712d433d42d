"""Files of parameters and of rules, spoilt."""

from pathlib import Path

import yaml
from values import HOSTILE, chance, spoilt_bytes, spoilt_record

FRAGMENTS = [
    '[' * 30 + ']' * 30,
    '[' * 5000 + ']' * 5000,
    '{a: ' * 3000,
    '&a [*a]',
    '*a',
    '!!python/object:os.system x',
    '!!binary aGk=',
    '!!set {a, b}',
    '!!omap [a: 1]',
    '2001-01-01',
    '0x' + 'f' * 300,
    '9' * 4400,
    '1:59:59',
    '.inf',
    '.nan',
    '-.inf',
    '1e400',
    '<<: {a: 1}',
    '"\\x1b[31m"',
    '"\\0"',
    '"\\u202e"',
    '? [a]\n: b',
    '|\n  text',
    '~',
    "''",
    '[1, [2, [3]]]',
    '{a: {b: {c: 1}}}',
    '- a\n- b',
    '%YAML 9.9',
    '---',
    '...',
    '\t',
    '1e-300',
    '1e300',
    '-1',
    '1000000000',
]


class Parameters:
    """Cases of spoilt parameters, for a replay, and of spoilt rules, for a gate.

    Args:
        inputs: a folder with scans.mcap, result.json and refine.yaml.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        self._bag, self._result = str(inputs / 'scans.mcap'), str(inputs / 'result.json')
        self._text = (inputs / 'refine.yaml').read_text()
        self._record = yaml.safe_load(self._text)
        self._rules = 'rules:\n  - frames > 1\n  - q_tot.p90 < 3e5\n  - status.converged >= 0.5\n'

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        is_rules = rng.random() < 0.3
        text = self._rules if is_rules else self._text
        Path('some.yaml').write_bytes(self._spoilt(rng, text, is_rules))
        if is_rules:
            return ['gate', self._result, '--rules', 'some.yaml']
        return ['replay', self._bag, '--params', 'some.yaml', '--duration', '0.15']

    def _spoilt(self, rng, text, is_rules):
        how = rng.random()
        if how < 0.3:
            return spoilt_bytes(rng, text.encode())
        if how < 0.45:
            return _bomb(rng).encode()
        if how < 0.7 and not is_rules:
            record = spoilt_record(rng, self._record)
            return yaml.safe_dump(record, allow_unicode=False).encode('utf-8', 'backslashreplace')
        lines = text.splitlines()
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(lines))
            name, separator, _ = lines[at].partition(':' if not is_rules else '-')
            value = chance(rng, *FRAGMENTS, *map(repr, HOSTILE))
            lines[at] = chance(rng, f'{name}{separator} {value}', value, lines[at] + value)
        return '\n'.join(lines).encode('utf-8', 'backslashreplace')


def _bomb(rng):
    """Return a few anchors, each of which repeats the one before it many times."""
    levels, times = rng.randint(1, 12), rng.randint(1, 30)
    inner, kind = chance(rng, '1', 'x', '[1,2]', '{a: 1}'), chance(rng, 'list', 'mapping', 'merge')
    lines = [f'  z0: &z0 {"{k: 1}" if kind == "merge" else inner}']
    for i in range(1, levels):
        again = [f'*z{i - 1}'] * times
        if kind == 'list':
            value = f'[{", ".join(again)}]'
        elif kind == 'merge':
            value = f'{{<<: [{", ".join(again)}]}}'
        else:
            value = '{' + ', '.join(f'k{k}: {each}' for k, each in enumerate(again)) + '}'
        lines.append(f'  z{i}: &z{i} {value}')
    where = chance(rng, '/**', 'other', 'rules')
    return f'{where}:\n ros__parameters:\n' + '\n'.join(lines) + f'\n/**:\n  x: *z{levels - 1}\n'
