"""The command `idem` as a process: Ctrl-C ends it in one line, from its first import on."""

import os
import signal
import sys

INTERRUPTED = 130


def _end_at_once(signum, frame):
    os.write(2, b'idem: interrupted\n')
    os._exit(INTERRUPTED)


# on import, before all others: as long as nothing has begun, there is nothing to end in order
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _end_at_once)


def main():
    """Run `idem` with the arguments of the process, and end with its exit code."""

    def idem():
        from idem_ros.commands.main import main as run

        return run()

    return ended_in_order(idem)


def ended_in_order(run):
    """Return the exit code of a command line, `run()`; after Ctrl-C end the process with it."""
    from idem_ros.terminal import interrupts

    try:
        interrupts.listen()
        code = _code(run, interrupts.came)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt
    except KeyboardInterrupt:
        code = _interrupted()
    if code == INTERRUPTED:
        interrupts.end(code)
    return code


def _code(run, came):
    try:
        code = run()
    except SystemExit as ended:
        code = ended.code
    except BaseException:
        if not came():
            raise
        return _interrupted()
    # where the interrupt was swallowed, the command did all it was to do, or says so itself
    return _interrupted() if came() and code != INTERRUPTED else code


def _interrupted():
    os.write(2, b'idem: interrupted\n')
    return INTERRUPTED


if __name__ == '__main__':
    sys.exit(main())
