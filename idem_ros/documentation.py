"""The parts of the README that are written by a command: what the code says of itself."""

from dataclasses import fields
from itertools import dropwhile, takewhile

from idem_ros.benchmarks.markdown import table
from idem_ros.commands.options import REPLAYED, option_name
from idem_ros.core.exceptions import IdemError
from idem_ros.node.interface import (
    INPUTS,
    OUTPUTS,
    POSE_INPUTS,
    SERVICES,
    TF_INPUTS,
    TF_OUTPUT,
    parameter_fields,
)
from idem_ros.parameters import default_of, description_of, parameter_name

FIGURES = 'docs/figures.md'
ACCURACY, SPEED = 'docs/bench_accuracy.md', 'docs/bench_speed.md'
TRUST = 'docs/bench_trust.md'
BEGIN, END = '<!-- {name}: written by `make docs` -->', '<!-- end of {name} -->'


def blocks(folder):
    """Return {name: Markdown} of the parts that follow from the code, and of measured figures.

    Args:
        folder: `Path` of the checkout; the figures are what `idem bench` wrote to its docs.
    """
    return {
        'figures': _lines_of(folder / FIGURES, ('|',)),
        'accuracy': _lines_of(folder / ACCURACY, ('-', '  -')),
        'speed': _lines_of(folder / SPEED, ('|',)),
        'trust': _lines_of(folder / TRUST, ('|',)),
        'topics': _topics(),
        'parameters': _parameters(),
    }


def with_blocks(text, contents):
    """Return a document with what stands between the marks of each block replaced.

    Raises:
        IdemError: the document lacks a mark.
    """
    for name, content in contents.items():
        begin, end = BEGIN.format(name=name), END.format(name=name)
        if text.count(begin) != 1 or text.count(end) != 1:
            raise IdemError(f'the document must hold the lines {begin!r} and {end!r} once each')
        before, rest = text.split(begin)
        _, after = rest.split(end)
        text = f'{before}{begin}\n{content}\n{end}{after}'
    return text


def _lines_of(path, starts):
    """Return the first run of lines that begin so: a report's verdicts stand before its tables."""
    lines = path.read_text().splitlines()
    from_first = dropwhile(lambda line: not line.startswith(starts), lines)
    return '\n'.join(takewhile(lambda line: line.startswith(starts), from_first))


def _topics():
    groups = {
        'in': [*INPUTS.values(), *POSE_INPUTS.values(), *TF_INPUTS.values()],
        'out': [*OUTPUTS.values(), TF_OUTPUT],
        'service': SERVICES.values(),
    }
    rows = [
        (f'`{topic.name}`', kind, f'`{topic.msgtype}`', topic.description)
        for kind, topics in groups.items()
        for topic in topics
    ]
    return table(['topic or service', '', 'type', 'what'], rows, left=4)


def _parameters():
    with_option = {each for config_type in REPLAYED for each in fields(config_type)}
    rows = [
        (
            f'`{parameter_name(each)}`',
            f'`{option_name(each)}`' if each in with_option else 'node only',
            f'`{default_of(each)}`',
            description_of(each),
        )
        for each in parameter_fields()
    ]
    return table(['parameter', 'option', 'default', 'what'], rows, left=4)
