"""How every kernel is compiled; the one place where that is decided."""

# The GIL is released, so that a node's callbacks go on. No nnan, no ninf: clouds hold NaN.
# No parallel=True: its work-queue aborts when a second Python thread enters it.
JIT = {
    'nogil': True,
    'cache': True,
    'error_model': 'numpy',
    'fastmath': {'nsz', 'arcp', 'contract', 'afn', 'reassoc'},
}
