"""The command `idem` as a process: Ctrl-C ends it in one line, from its first import on."""

import signal
import sys

from idem_ros import interrupts

INTERRUPTED = 130


def main():
    """Run `idem` with the arguments of the process, and end with its exit code."""
    interrupts.listen()
    try:
        code = _code()
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt
    except KeyboardInterrupt:
        code = _interrupted()
    if code == INTERRUPTED:
        interrupts.end(code)
    return code


def _code():
    try:
        from idem_ros.commands.main import main as run

        code = run()
    except SystemExit as ended:
        code = ended.code
    except BaseException:
        if not interrupts.came():
            raise
        return _interrupted()
    # where the interrupt was swallowed, the command did all it was to do, or says so itself
    return _interrupted() if interrupts.came() and code != INTERRUPTED else code


def _interrupted():
    print('idem: interrupted', file=sys.stderr)
    return INTERRUPTED
