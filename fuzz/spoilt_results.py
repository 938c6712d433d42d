"""Results of replays, spoilt, before the five commands that read them."""

import json
from pathlib import Path

from values import chance, spoilt_bytes, spoilt_record

RULES = """rules:
  - frames > 1
  - verdict.aligned > 0.5
  - status.converged > 0.1
  - time_ms.p95 < 100
  - q_tot.max < 4
  - translation_error_m.p90 < 1
"""
COMMANDS = {
    'gate': ['gate', 'RESULT', '--rules', 'rules.yaml', '--junit', 'gate.xml'],
    'compare': ['compare', 'result.json', 'RESULT', '--json'],
    'table': ['compare', 'RESULT', 'result.json'],
    'again': ['replay', '--again', 'RESULT'],
    'report': ['report', 'RESULT', '--out', 'report'],
    'show': ['show', 'RESULT', '--out', 'page.html'],
}
SHARES = ['gate'] * 40 + ['compare'] * 20 + ['table'] * 20 + ['again'] * 18 + ['report', 'show']


class Results:
    """Cases of spoilt results.

    Args:
        inputs: a folder with scans.mcap, result.json and result.mcap.
    """

    def __init__(self, inputs):
        self._inputs = Path(inputs)
        self._json = (self._inputs / 'result.json').read_bytes()
        self._mcap = (self._inputs / 'result.mcap').read_bytes()
        self._record = json.loads(self._json)
        self._record['bag'] = str(self._inputs / 'scans.mcap')

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        Path('result.json').write_bytes(self._json)
        Path('rules.yaml').write_text(RULES)
        how, name = rng.random(), 'spoilt.json'
        if how < 0.8:
            text = json.dumps(spoilt_record(rng, self._record))
            Path(name).write_text(text)
        elif how < 0.9:
            Path(name).write_bytes(spoilt_bytes(rng, self._json))
        else:
            name = 'spoilt.mcap'
            Path(name).write_bytes(spoilt_bytes(rng, self._mcap))
        command = COMMANDS[chance(rng, *SHARES)]
        return [name if each == 'RESULT' else each for each in command]
