"""Command lines: errors in one line that says what would be right, exit codes, and a bar."""

import argparse
import sys
from difflib import get_close_matches
from typing import Any

from idem_ros.core.exceptions import IdemError
from idem_ros.terminal.printable import message_line

# how `idem` ends; USAGE: it was called wrongly
OK, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130
WANTED = {int: 'whole number', float: 'number'}


class UsageError(IdemError):
    """A command line that contradicts itself or asks for what does not exist."""


class CommandLine(argparse.ArgumentParser):
    """A parser that says in one line what is wrong, and shows what commands there are."""

    def __init__(self, *args, description=None, **options):
        """See argparse; a description of several lines is shown as it stands."""
        if '\n' in (description or ''):
            options.setdefault('formatter_class', argparse.RawDescriptionHelpFormatter)
        super().__init__(*args, description=description, **options)

    def error(self, message, meant=''):
        """Say in one line what is wrong, where argparse prints the whole usage first."""
        hint = f'{meant}see {self.prog} --help'
        self.exit(USAGE, f'{self.prog}: error: {message_line(message)} ({hint})\n')

    def parse_known_args(self, args=None, namespace=None):
        """Parse; what is left over is an error of this command, not of the one above it."""
        namespace, left = super().parse_known_args(args, namespace)
        if left:
            option = next((word for word in left if word.startswith('-')), None)
            if option is None:
                self.error(f'unrecognized {" ".join(left)}', 'a name with spaces needs quotes; ')
            name = option.partition('=')[0]
            self.error(f'unrecognized {name}', _meant(name, self._option_string_actions))
        return namespace, left

    def _get_value(self, action, arg_string):
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if (wanted := WANTED.get(action.type)) is None:
                raise
            raise argparse.ArgumentError(action, f'{arg_string!r} is no {wanted}') from error

    def _check_value(self, action, value):
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            self.error(str(error), _meant(str(value), map(str, action.choices or ())))

    def add_subparsers(self, **options):
        """Add commands; who names none is shown what there are."""
        self.set_defaults(run=self._show_help)
        return super().add_subparsers(**options)

    def _show_help(self, args):
        self.print_help(sys.stderr)
        return USAGE


def _meant(word, names):
    close = get_close_matches(word, names, n=1)
    return f'did you mean {close[0]}? ' if close else ''


def progress(steps: Any = None, total=None, desc=None, **options) -> Any:
    """Return what iterates over steps and shows how far it is, see `tqdm`; no bar stays behind.

    Where there is no terminal it shows nothing.
    """
    from tqdm import tqdm  # late: most commands show none

    return tqdm(steps, total=total, desc=desc, leave=False, disable=None, **options)
