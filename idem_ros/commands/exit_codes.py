"""How `idem` ends: 0, or a code that says whose turn it is."""

from idem_ros.core.exceptions import IdemError
from idem_ros.terminal.command_line import USAGE

OK = 0
FAILED = 1
INTERRUPTED = 130

__all__ = ['FAILED', 'INTERRUPTED', 'OK', 'USAGE', 'UsageError']


class UsageError(IdemError):
    """A command line that contradicts itself or asks for what does not exist."""
