"""What `idem` says of its commands and their options, as Markdown."""

import argparse

from idem_ros.commands.main import command_line
from idem_ros.commands.options import TITLES
from idem_ros.terminal.markdown import table

# argparse shows what it was told by its help alone, whose layout differs from Python to Python.


def command_tables():
    """Return a section for each command: what it does, its arguments, its groups of parameters."""
    (commands,) = (
        action
        for action in command_line()._actions
        if isinstance(action, argparse._SubParsersAction)
    )
    return '\n\n'.join(_section(name, parser) for name, parser in commands.choices.items())


def _section(name, parser):
    groups = [group for group in parser._action_groups if group._group_actions]
    shared = [group.title for group in groups if group.title in TITLES.values()]
    rows = [
        (_shown(action), _said(action))
        for group in groups
        if group.title not in shared
        for action in group._group_actions
        if action.dest != 'help'
    ]
    options = table(['', 'what'], rows, left=2).rstrip()
    parts = [f'### idem {name}', _prose(parser.description), options]
    if shared:
        parts.append(f'And the [parameters](reference.md#parameters) of: {", ".join(shared)}.')
    return '\n\n'.join(part for part in parts if part)


def _prose(text):
    """Lines that were set by hand stay as they are."""
    return f'```text\n{text.rstrip()}\n```' if '\n' in text else text


def _shown(action):
    words = action.option_strings or [action.metavar or action.dest]
    if action.option_strings and action.nargs != 0:
        values = '|'.join(map(str, action.choices)) if action.choices else action.metavar
        words = [f'{words[-1]} {values or action.dest.upper()}']
    return f'`{words[-1] if action.option_strings else words[0]}`'


def _said(action):
    return (action.help or '').replace('%(default)s', str(action.default))
