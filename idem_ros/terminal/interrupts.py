"""Ctrl-C: kept back where work must not be left half done, and one orderly end of a command."""

import os
import signal
import sys
import threading
from contextlib import contextmanager, suppress

AGAIN = 0.05  # [s] after which one that was swallowed, or came too early, is sent again
_came = threading.Event()


def came():
    """Return whether Ctrl-C has been pressed since `listen`."""
    return _came.is_set()


def listen():
    """Take Ctrl-C from here on as a KeyboardInterrupt that is remembered.

    It is raised between two lines of Python, wherever these are: within a callback of compiled
    code it comes out as another exception, or as none. Therefore `came` is what decides.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as nohup and a shell's & have it
        return
    signal.signal(signal.SIGINT, _interrupt)
    sys.unraisablehook = _send_again


def end(code):
    """End the process after Ctrl-C, without the end of the interpreter.

    That would wait for threads, and take from under others the arrays they still read.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


@contextmanager
def held_back():
    """Keep Ctrl-C back within the block; a second one comes through.

    Yields:
        A function that returns whether it was pressed. What nobody has asked for comes when the
        block ends.
    """
    handler = signal.getsignal(signal.SIGINT)
    is_main = threading.current_thread() is threading.main_thread()
    if not (is_main and callable(handler)):
        yield lambda: False
        return
    received, seen = [], []

    def keep(signum, frame):
        if received:
            handler(signum, frame)
        received.append(signum)

    def was_pressed():
        seen.extend(received)
        return bool(received)

    signal.signal(signal.SIGINT, keep)
    try:
        yield was_pressed
    finally:
        signal.signal(signal.SIGINT, handler)
        if received and not seen:
            signal.raise_signal(signal.SIGINT)


def _interrupt(signum, frame):
    _came.set()
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
    timer = threading.Timer(AGAIN, signal.pthread_kill, [main, signal.SIGINT])
    timer.daemon = True
    timer.start()
