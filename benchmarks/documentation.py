"""The parts of the documents that are written by a command: what the code says of itself."""

from dataclasses import fields
from itertools import dropwhile, takewhile

from benchmarks.command_tables import command_tables
from benchmarks.parameter_text import parameter_text
from idem_ros.calibration.config import RigWatchConfig
from idem_ros.commands.options import REPLAYED, option_name
from idem_ros.core.exceptions import IdemError
from idem_ros.core.parameter import parameter_name
from idem_ros.node.interface import (
    IMU_INPUTS,
    INPUTS,
    OUTPUTS,
    POSE_INPUTS,
    RIG_OUTPUT,
    SERVICES,
    TF_INPUTS,
    TF_OUTPUT,
    parameter_fields,
)
from idem_ros.parameters.fields import default_of, description_of
from idem_ros.terminal.markdown import table

FIGURES, PARAMETERS = 'docs/figures.md', 'config/refine.yaml'
ACCURACY, SPEED = 'docs/bench_accuracy.md', 'docs/bench_speed.md'
TRUST, REAL = 'docs/bench_trust.md', 'docs/bench_real.md'
SMALL = 0.05  # p of what is taken to be no chance
BEGIN, END = '<!-- {name}: written by `make docs` -->', '<!-- end of {name} -->'


def blocks(folder):
    """Return {name: Markdown} of the parts that follow from the code, and of measured figures.

    Args:
        folder: `Path` of the checkout; the figures are what `make bench` wrote to its docs.
    """
    return {
        'figures': _lines_of(folder / FIGURES, ('|',)),
        'accuracy': _lines_of(folder / ACCURACY, ('-', '  -')),
        'speed': _lines_of(folder / SPEED, ('|',)),
        'trust': _lines_of(folder / TRUST, ('|',)),
        'real': near_starts(folder / REAL),
        'topics': _topics(),
        'parameters': _parameters(),
        'rig': _rig(),
        'commands': command_tables(),
    }


def documents(readme):
    """Return {path: text as it should be} of README, documents and file of parameters.

    Args:
        readme: `Path` of the checkout's README; the others are in its folder's docs.

    Raises:
        IdemError: a block stands in none of them, or in several.
    """
    paths = [readme, *sorted((readme.parent / 'docs').glob('*.md'))]
    texts = {path: path.read_text() for path in paths}
    contents = blocks(readme.parent)
    for name in contents:
        places = [path for path, text in texts.items() if BEGIN.format(name=name) in text]
        if len(places) != 1:
            where = ', '.join(path.name for path in places) or 'no document'
            raise IdemError(f'the block {name} stands in {where}; it must stand in one')
    written = {path: with_blocks(text, contents) for path, text in texts.items()}
    return {**written, readme.parent / PARAMETERS: parameter_text()}


def with_blocks(text, contents):
    """Return a document with what stands between the marks of each of its blocks replaced.

    Raises:
        IdemError: of a block it has one mark only, or one of them twice.
    """
    for name, content in contents.items():
        begin, end = BEGIN.format(name=name), END.format(name=name)
        counts = text.count(begin), text.count(end)
        if counts == (0, 0):
            continue
        if counts != (1, 1):
            raise IdemError(f'the document must hold the lines {begin!r} and {end!r} once each')
        before, rest = text.split(begin)
        _, after = rest.split(end)
        text = f'{before}{begin}\n{content}\n{end}{after}'
    return text


def near_starts(path):
    """Return the rows of near starts, and what a peer does better there beyond chance."""
    lines = path.read_text().splitlines()
    head, _, *rest = (_cells_of(line) for line in lines if line.startswith('|'))
    near = [row for row in rest if row[1] == 'near']
    kept = [k for k, name in enumerate(head) if name not in ('starts', 'setting')]
    rows = [[row[k] for k in kept] for row in (head, ['---'] * len(head), *near)]
    better = [line for line in lines if line.startswith('- ') and ', near: ' in line]
    beyond = [line.replace(', near', '') for line in better if _is_beyond_chance(line)]
    said = [
        f'\nOf {len(better)} figures in which a peer is ahead there, those beyond chance are:\n',
        *(beyond or ['- none']),
    ]
    return '\n'.join([*('|'.join(['', *row, '']) for row in rows), *said])


def _cells_of(row):
    return [cell.strip() for cell in row.split('|')[1:-1]]


def _is_beyond_chance(line):
    """Whether the interval of a ratio leaves out 1, or p of a count is small; a time has none."""
    _, has_p, p = line.partition('by chance p ')
    if has_p:
        return float(p) < SMALL
    _, has_interval, interval = line.partition('IDEM over it ')
    return not has_interval or float(interval.split()[0]) > 1.0


def _lines_of(path, starts):
    """Return the first run of lines that begin so: a report's verdicts stand before its tables."""
    lines = path.read_text().splitlines()
    from_first = dropwhile(lambda line: not line.startswith(starts), lines)
    return '\n'.join(takewhile(lambda line: line.startswith(starts), from_first))


def _topics():
    groups = {
        'in': [*INPUTS.values(), *POSE_INPUTS.values(), *TF_INPUTS.values(), *IMU_INPUTS.values()],
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


def _rig():
    rows = [
        (f'`{parameter_name(each)}`', f'`{default_of(each)}`', description_of(each))
        for each in fields(RigWatchConfig)
    ]
    said = f'On `{RIG_OUTPUT.name}`: {RIG_OUTPUT.description}.'
    return table(['parameter', 'default', 'what'], rows, left=3) + f'\n{said}'
