"""How every kernel is compiled; the one place where that is decided, and told."""

# Numba has no types.
# pyright: reportUnknownMemberType=false

import gc
import logging
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event
from numba.extending import register_jitable

from idem_ros.core.kernel_cache import cache_of, kept_in_words

Function = TypeVar('Function', bound=Callable[..., Any])

PACKAGE = __name__.partition('.')[0]
COLLECT_EVERY = 50_000  # objects


def compiler(**options: Any) -> Callable[[Function], Function]:
    """Return a decorator: a function is compiled when it is first called, or was kept.

    Args:
        options: of `numba.njit`.
    """

    def decorate(function: Function) -> Function:
        """Return the function compiled, with a cache of its own."""
        dispatcher: Any = cast(Any, njit(**options))(function)
        dispatcher._cache = cache_of(function)  # what cache=True does, with a cache of numba's
        return dispatcher

    return decorate


# The GIL is released, so that a node's callbacks go on. No nnan, no ninf: clouds hold NaN.
# No parallel=True: its work-queue aborts when a second Python thread enters it.
# forceinline: a kernel from the cache brings its own copy of what it calls, one just compiled
# finds another, which was optimised alone and may differ in its last bits.
# No wrapper for C, which nobody calls: a tenth of the time that compiling takes.
_OPTIONS: dict[str, Any] = {
    'nogil': True,
    'forceinline': True,
    'error_model': 'numpy',
    'fastmath': {'nsz', 'arcp', 'contract', 'afn', 'reassoc'},
    'no_cfunc_wrapper': True,
}
kernel = compiler(**_OPTIONS)


def inlined(function: Function) -> Function:
    """Let kernels call a function, which becomes a part of each; called by Python it is Python.

    It is neither wrapped for Python nor kept, which saves an eighth of a cold start.
    """
    return cast(Any, register_jitable(**_OPTIONS))(function)


class _Compiling(event.Listener):
    """Say once that kernels are being compiled, which numba does where its cache is cold.

    The compiler makes objects by the million, most of which stay: the collector looks through them
    less often meanwhile, which saves a tenth of the time.
    """

    def __init__(self) -> None:
        self.has_told, self._depth, self._threshold = False, 0, gc.get_threshold()

    def on_start(self, event: Any) -> None:
        """Tell, where the kernel is one of this package."""
        if self._depth == 0:
            self._threshold = gc.get_threshold()
            young, *older = self._threshold
            gc.set_threshold(max(COLLECT_EVERY, young) if young else 0, *older)  # 0: it is off
        self._depth += 1
        dispatcher = event.data['dispatcher']
        if not self.has_told and dispatcher.py_func.__module__.startswith(PACKAGE):
            self.has_told = True
            how_often = kept_in_words(dispatcher._cache)
            logging.getLogger(PACKAGE).warning(
                'compiling kernels: up to half a minute, %s', how_often
            )

    def on_end(self, event: Any) -> None:
        """Let the collector look as often as before; the first result tells."""
        self._depth -= 1
        if self._depth == 0:
            gc.set_threshold(*self._threshold)


event.register('numba:compile', _Compiling())
