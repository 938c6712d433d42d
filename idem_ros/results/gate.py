"""Rules that a result must keep: `translation_error_m.p90 < 0.05`, read strictly and checked."""

import math
import operator
import re
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.status import Status
from idem_ros.core.trust.verdict import Verdict
from idem_ros.files.atomic_file import replacing
from idem_ros.files.structured_text import UnreadableText, read_yaml
from idem_ros.recording.part import LOSSES

EXPECTED = 'NAME[.STATISTIC] OP NUMBER, such as translation_error_m.p90 < 0.05'
RULE = re.compile(
    r'(?P<name>[A-Za-z_]\w*)(\.(?P<statistic>[A-Za-z_]\w*(\.\d+)?))?'
    r'\s*(?P<operator>[<>=!]=|[<>])\s*'
    r'(?P<bound>[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)',
    re.ASCII,
)
LONGEST = 200
PERCENTILE = re.compile(r'p([1-9]\d?(\.\d)?)', re.ASCII)
OPERATORS = {
    '<': operator.lt,
    '<=': operator.le,
    '>': operator.gt,
    '>=': operator.ge,
    '==': operator.eq,
    '!=': operator.ne,
}
STATISTICS = {'mean': np.mean, 'median': np.median, 'min': np.min, 'max': np.max, 'count': len}
SHARES = {
    'status': tuple(status.value for status in Status),
    'verdict': tuple(verdict.value for verdict in Verdict),
}
"""What each frame has one of: a rule is about the share of the frames that have it."""
PARTIAL = ('interrupted', *(name for name in LOSSES if name != 'files_extra'))
"""What makes a result one of a part of its recording: none, unless a rule speaks of it."""


class BadRules(IdemError):
    """A file of rules that cannot be read, or a rule that is none."""


@dataclass(frozen=True)
class Rule:
    """One rule of a file."""

    text: str
    place: str
    """File and number of the rule, for messages."""
    name: str
    statistic: str | None
    operator: str
    bound: float


@dataclass(frozen=True)
class Finding:
    """What a rule found in a result."""

    rule: Rule
    value: float | None
    """None: there is none, for the reason."""
    reason: str
    holds: bool


def read_rules(path):
    """Read a YAML file with a list `rules`, each `NAME[.STATISTIC] OP NUMBER`.

    Returns:
        [`Rule`], at least one; whether a result has their names is for `findings` to say.

    Raises:
        BadRules: names the file, the number of the rule and what would be right.
    """
    try:
        content = read_yaml(path)
    except UnreadableText as error:
        raise BadRules(f'{error}; it must hold one list named rules') from error
    if not (isinstance(content, dict) and list(content) == ['rules']):
        raise BadRules(f'{path} must hold one list named rules, and nothing else')
    if not isinstance(content['rules'], list):
        raise BadRules(f'{path} must hold one list named rules; its rules are no list')
    if not content['rules']:
        raise BadRules(f'{path} holds no rule; one that holds for every result would be none')
    return [_rule(each, f'{path}, rule {i}') for i, each in enumerate(content['rules'], start=1)]


def findings(rules, results):
    """Return the `Finding` of each rule in each result: a list for each result.

    Of a result that was interrupted, or whose recording was read in part, there is one more for
    each such count that no rule speaks of, and it does not hold.

    Args:
        rules: [`Rule`].
        results: [`Result`]; a name that one of them has, each may have.

    Raises:
        BadRules: a name that no result has, or a statistic that does not suit it.
    """
    counts = {name for result in results for name in result.counts}
    numbers = dict.fromkeys(name for result in results for name in result.numbers())
    for rule in rules:
        _require_known(rule, counts, numbers)
    return [
        [*(_finding(rule, result) for rule in rules), *_unspoken(rules, result)]
        for result in results
    ]


def _unspoken(rules, result):
    """Yield what makes a result partial and no rule speaks of."""
    spoken = {rule.name for rule in rules}
    for name in PARTIAL:
        if name not in spoken and result.counts.get(name):
            rule = Rule(f'{name} == 0', 'of every result', name, None, '==', 0.0)
            yield _finding(rule, result)


def _rule(given, place):
    kinds = {dict: 'a mapping', list: 'a sequence'}
    text = kinds.get(type(given)) or ('' if given is None else str(given).strip())
    if len(text) > LONGEST:  # the time of the pattern grows with the square of the length
        raise BadRules(f'{place} has {len(text)} letters; it must be {EXPECTED}')
    match = RULE.fullmatch(text)
    if match is None or not math.isfinite(float(match['bound'])):
        raise BadRules(f'{place} is {text!r}; it must be {EXPECTED}')
    name, statistic = match['name'], match['statistic']
    return Rule(text, place, name, statistic, match['operator'], float(match['bound']))


def _require_known(rule, counts, numbers):
    if rule.name in SHARES:
        right = [f'{rule.name}.{value}' for value in SHARES[rule.name]]
        if rule.statistic not in SHARES[rule.name]:
            raise BadRules(f'{rule.place}: {rule.text!r} must begin with {", ".join(right)}')
    elif rule.name in counts:
        if rule.statistic:
            raise BadRules(f'{rule.place}: {rule.name} is a count; write it without a statistic')
    elif rule.name not in numbers and any(numbers):
        raise BadRules(
            f'{rule.place}: no result has {rule.name!r}; there are '
            f'{", ".join([*sorted(counts), *SHARES, *numbers])}'
        )
    elif rule.statistic not in STATISTICS and not PERCENTILE.fullmatch(rule.statistic or ''):
        raise BadRules(
            f'{rule.place}: {rule.text!r} must name a statistic, as in {rule.name}.p95: '
            f'{", ".join(STATISTICS)}, p1 to p99.9'
        )


def _finding(rule, result):
    value, reason = _value(rule, result)
    holds = value is not None and OPERATORS[rule.operator](value, rule.bound)
    return Finding(rule, value, reason, bool(holds))


def _value(rule, result):
    """Return the number that a rule speaks of, and the reason why there is none."""
    if rule.name in result.counts:
        return result.counts[rule.name], ''
    if not result.frames:
        return None, 'no frame was refined'
    if rule.name in SHARES:
        found = [frame.get(rule.name) for frame in result.frames]
        if not any(found):
            return None, f'no frame has a {rule.name}'
        return found.count(rule.statistic) / len(found), ''
    values = result.values(rule.name)
    known = values[~np.isnan(values)]
    if not known.size and rule.statistic != 'count':
        hint = '; is there ground truth?' if 'error' in rule.name else ''
        return None, f'no frame has a {rule.name}{hint}'
    return _statistic(rule.statistic, known), ''


def _statistic(name, values):
    if name in STATISTICS:
        return float(STATISTICS[name](values))
    return float(np.percentile(values, float(name[1:])))


def write_junit(path, found):
    """Write one test case for each rule, in a suite for each result.

    Args:
        path: the XML file.
        found: {name of a result: [`gate.Finding`]}.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    root = ElementTree.Element(
        'testsuites', {'name': 'idem gate', **_counts(sum(found.values(), []))}
    )
    for name, findings in found.items():
        name = _printable(name)
        suite = ElementTree.SubElement(root, 'testsuite', {'name': name, **_counts(findings)})
        for finding in findings:
            labels = {'classname': name, 'name': finding.rule.text}
            case = ElementTree.SubElement(suite, 'testcase', labels)
            if not finding.holds:
                message = finding.reason or f'found {finding.value:.6g}'
                ElementTree.SubElement(case, 'failure', {'message': message})
    _write(path, root)


def write_junit_error(path, error):
    """Write one test case that could not be decided: an older file would speak for this gate.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    counts = {'tests': '1', 'failures': '0', 'errors': '1'}
    root = ElementTree.Element('testsuites', {'name': 'idem gate', **counts})
    suite = ElementTree.SubElement(root, 'testsuite', {'name': 'idem gate', **counts})
    labels = {'classname': 'idem gate', 'name': 'rules and results can be read'}
    case = ElementTree.SubElement(suite, 'testcase', labels)
    ElementTree.SubElement(case, 'error', {'message': _printable(str(error))})
    _write(path, root)


def _write(path, root):
    ElementTree.indent(root)
    with replacing(path) as temporary:
        temporary.write_bytes(ElementTree.tostring(root, encoding='utf-8', xml_declaration=True))


def _counts(findings):
    failures = sum(not finding.holds for finding in findings)
    return {'tests': str(len(findings)), 'failures': str(failures), 'errors': '0'}


def _printable(name):
    """Replace what XML cannot hold: file names may contain anything."""
    return ''.join(letter if letter.isprintable() else '?' for letter in name)
