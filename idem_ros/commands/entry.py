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
    """Return the exit code of a command line; end the process where it was interrupted."""
    from idem_ros.terminal import interrupts

    try:
        interrupts.listen()
        code = _code(run, interrupts)
        interrupts.ignore()
    except KeyboardInterrupt:
        code = _interrupted(interrupts)
    if code == INTERRUPTED:
        interrupts.end()
    return code


def _code(run, interrupts):
    try:
        code = run()
    except SystemExit as ended:
        code = ended.code
    except BaseException:
        if not interrupts.came():
            raise
        return _interrupted(interrupts)
    # where the interrupt was swallowed, the command did all it was to do, or says so itself
    return _interrupted(interrupts) if interrupts.came() and code != INTERRUPTED else code


def _interrupted(interrupts):
    os.write(2, f'{interrupts.line()}\n'.encode())
    return INTERRUPTED


if __name__ == '__main__':
    sys.exit(main())
