"""How every kernel is compiled; the one place where that is decided, and told."""

import logging

from numba.core import event

# The GIL is released, so that a node's callbacks go on. No nnan, no ninf: clouds hold NaN.
# No parallel=True: its work-queue aborts when a second Python thread enters it.
# forceinline: a kernel from the cache brings its own copy of what it calls, one just compiled
# finds another, which was optimised alone and may differ in its last bits.
JIT = {
    'nogil': True,
    'cache': True,
    'forceinline': True,
    'error_model': 'numpy',
    'fastmath': {'nsz', 'arcp', 'contract', 'afn', 'reassoc'},
}
PACKAGE = __name__.partition('.')[0]


class _Teller(event.Listener):
    """Say once that kernels are being compiled, which numba does where its cache is cold."""

    def __init__(self):
        self.has_told = False

    def on_start(self, event):
        """Tell, where the kernel is one of this package."""
        module = event.data['dispatcher'].py_func.__module__
        if not self.has_told and module.startswith(PACKAGE):
            self.has_told = True
            logging.getLogger(PACKAGE).warning('compiling kernels: once, about half a minute')

    def on_end(self, event):
        """Do nothing: the first result tells."""


event.register('numba:compile', _Teller())
