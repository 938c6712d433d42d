"""Ctrl-C and its like: kept back where work must not be left half done, and one orderly end.

What a terminal, a container or a shutdown sends (SIGINT, SIGTERM, SIGHUP) is all the same to the
work: it stops, and nothing half written stays. Only the exit code tells them apart.
"""

import os
import signal
import sys
import threading
from contextlib import contextmanager, suppress

SAID: dict[int, str] = {
    signal.SIGINT: 'interrupted',
    signal.SIGTERM: 'terminated',
    signal.SIGHUP: 'terminal closed',
}
"""What ends a command in order, and what it says then."""
AGAIN = 0.05  # [s] after which one that was swallowed, or came too early, is sent again
_came: list[int] = []


def came():
    """Return whether one of `SAID` has come since `listen`."""
    return bool(_came)


def line(prog='idem'):
    """Return what a command says at its end, of the first that came."""
    return f'{prog}: {SAID[_first()]}'


def listen():
    """Take what is in `SAID` from here on as a KeyboardInterrupt that is remembered.

    It is raised between two lines of Python, wherever these are: within a callback of compiled
    code it comes out as another exception, or as none. Therefore `came` is what decides.
    """
    for signum in SAID:
        if signal.getsignal(signum) is not signal.SIG_IGN:  # as nohup and a shell's & have it
            signal.signal(signum, _interrupt)
    sys.unraisablehook = _send_again


def ignore():
    """Take no more of them: nothing is left to interrupt."""
    for signum in SAID:
        signal.signal(signum, signal.SIG_IGN)


def end():
    """End the process with 128 and the number of what came, without the end of the interpreter.

    That would wait for threads, and take from under others the arrays they still read.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(128 + _first())


@contextmanager
def held_back():
    """Keep what is in `SAID` back within the block; a second one comes through.

    Yields:
        A function that returns whether one came. What nobody has asked for comes when the
        block ends.
    """
    is_main = threading.current_thread() is threading.main_thread()
    found = {signum: signal.getsignal(signum) for signum in SAID} if is_main else {}
    handlers = {signum: handler for signum, handler in found.items() if callable(handler)}
    received, seen = [], []

    def keep(signum, frame):
        if received:
            handlers[signum](signum, frame)
        received.append(signum)

    def has_come():
        seen.extend(received)
        return bool(received)

    for signum in handlers:
        signal.signal(signum, keep)
    try:
        yield has_come
    finally:
        for signum, handler in handlers.items():
            signal.signal(signum, handler)
        if received and not seen:
            signal.raise_signal(received[0])


def _first():
    return _came[0] if _came else signal.SIGINT


def _interrupt(signum, frame):
    _came.append(signum)
    if _is_called_by_llvm(frame):
        _send_later()
    else:
        raise KeyboardInterrupt


def _is_called_by_llvm(frame):
    """LLVM asks Python for a kernel that is kept, and calls address 0 where it was not told."""
    while frame is not None:
        if frame.f_globals.get('__name__', '').startswith('llvmlite.'):
            return True
        frame = frame.f_back
    return False


def _send_again(unraisable):
    """Take what came in a callback that cannot raise: nobody would hear of it."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        _send_later()
    else:
        sys.__unraisablehook__(unraisable)


def _send_later():
    main = threading.main_thread().ident
    timer = threading.Timer(AGAIN, signal.pthread_kill, [main, _first()])
    timer.daemon = True
    timer.start()
