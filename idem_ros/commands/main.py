"""The command `idem`: registration of point clouds from files and recordings."""

import argparse
import logging
import os
import sys
from contextlib import redirect_stdout
from io import TextIOWrapper
from typing import Any

from idem_ros.commands import (
    align,
    bag,
    calibrate,
    compare,
    demo,
    evaluate,
    experiments,
    gate,
    play,
    register,
    replay,
    report,
    show,
    simulate,
    smooth,
    trajectory,
    truth,
)
from idem_ros.commands import map as map_  # the builtin is in use here
from idem_ros.commands.output_names import note_replaced
from idem_ros.core.exceptions import IdemError
from idem_ros.terminal import interrupts
from idem_ros.terminal.command_line import FAILED, INTERRUPTED, USAGE, CommandLine, UsageError
from idem_ros.terminal.printable import ShownStream, message_line

COMMANDS = (
    register,
    align,
    bag,
    calibrate,
    replay,
    smooth,
    evaluate,
    report,
    show,
    gate,
    compare,
    trajectory,
    truth,
    play,
    demo,
    simulate,
    map_,
    experiments,
)

LEFT = {'bench': 'python -m benchmarks', 'docs': 'make docs'}
"""Commands that are no part of the package any more, which a script may still call."""


class _Version(argparse.Action):
    def __call__(self, parser, *args):
        """Print the installed version and end; looked up only when it is asked for."""
        from importlib.metadata import version

        print(f'{parser.prog} {version("idem_ros")}')
        parser.exit()


def main(argv=None):
    """Run `idem` with the given arguments (None: those of the process); return its exit code."""
    parser = command_line()
    words = sys.argv[1:] if argv is None else argv
    if words and words[0] in LEFT:
        parser.error(f'`idem {words[0]}` is `{LEFT[words[0]]}` now, in a checkout of the project')
    return run(parser, words)


def run(parser, words):
    """Run what a command line asks for.

    Args:
        parser: `CommandLine`, whose commands set `run`, which takes the namespace and returns the
            exit code.
        words: the arguments.

    Returns:
        The exit code; what a user did ends in one line on stderr.
    """
    _let_any_name_be_printed()
    args = parser.parse_args(words)
    _refuse_empty(parser, args)
    _log_in_lines(parser.prog)
    shown: Any = ShownStream(sys.stdout)
    try:
        with redirect_stdout(shown):
            code = args.run(args)
        note_replaced(args)
        sys.stdout.flush()
        return code
    except SystemExit as ended:
        if ended.code != INTERRUPTED:
            raise
        return _ended_by(KeyboardInterrupt(), parser.prog)
    except (Exception, KeyboardInterrupt) as error:
        code = _ended_by(error, parser.prog)
        if code is None:
            raise
        return code


def _refuse_empty(parser, args):
    """A variable of a script that is not set gives '', which names no file and no topic."""
    for name, value in vars(args).items():
        if '' in (value if isinstance(value, list) else [value]):
            parser.error(f'{name.replace("_", "-")} is given as an empty text')


def _ended_by(error, prog):
    """Say in one line what ended a command, and return its exit code; None: a mistake of ours."""
    if isinstance(error, KeyboardInterrupt) or interrupts.came():
        print(interrupts.line(prog), file=sys.stderr)
        return INTERRUPTED
    if isinstance(error, BrokenPipeError):  # the reader of our output went away: `idem ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    if not isinstance(error, IdemError | OSError):  # a full disk, a file that vanished
        return None
    print(f'{prog}: error: {message_line(error)}', file=sys.stderr)
    return USAGE if isinstance(error, UsageError) else FAILED


def _log_in_lines(prog):
    class Line(logging.Formatter):
        def format(self, record):
            return message_line(super().format(record))

    handler = logging.StreamHandler()
    handler.setFormatter(Line(f'{prog}: %(message)s'))
    logging.basicConfig(handlers=[handler])


def _let_any_name_be_printed():
    """File names need not be UTF-8, nor does a terminal show every letter."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # not where something else took its place
            stream.reconfigure(errors='backslashreplace')


def command_line():
    """Return the parser of `idem` and of its commands."""
    parser = CommandLine(prog='idem', description='Fine registration of point clouds by entropy.')
    parser.add_argument('--version', action=_Version, nargs=0, help='print the version')
    subparsers = parser.add_subparsers(title='commands', metavar='COMMAND')
    for command in COMMANDS:
        command.add_parser(subparsers)
    return parser
