"""How `idem` ends: 0, or a code that says whose turn it is."""

from idem_ros.core.exceptions import IdemError

OK = 0
FAILED = 1
USAGE = 2
INTERRUPTED = 130


class UsageError(IdemError):
    """A command line that contradicts itself or asks for what does not exist."""
