"""Ctrl-C that is kept back, and Ctrl-C that libraries make something else of."""

import signal
import subprocess
import sys

import pytest

from idem_ros.terminal.interrupts import held_back


def test_what_is_held_back_comes_when_the_block_ends():
    steps = []
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - where it is raised is what is tested
        with held_back():
            signal.raise_signal(signal.SIGINT)
            steps.append('within')
        steps.append('after')
    assert steps == ['within']


def test_who_asks_whether_it_was_pressed_ends_by_himself():
    with held_back() as interrupted:
        assert not interrupted()
        signal.raise_signal(signal.SIGINT)
        assert interrupted()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_ctrl_c_is_not_held_back():
    with pytest.raises(KeyboardInterrupt), held_back() as interrupted:  # noqa: PT012
        signal.raise_signal(signal.SIGINT)
        assert interrupted()
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize(
    'swallowed_by',
    [
        # a callback of C, an exception that becomes another, one that is caught
        'import ctypes; ctypes.CFUNCTYPE(None)(press)()',
        'class A:\n def __del__(self): press()\nA()',
        'try: press()\nexcept BaseException: raise SystemError("with an exception set")',
        'try: press()\nexcept BaseException: raise IdemError("a damaged file")',
        'try: press()\nexcept BaseException: raise SystemExit(1)',
        'try: press()\nexcept BaseException: pass',
    ],
)
def test_ctrl_c_that_libraries_make_something_else_of_still_ends_the_command(swallowed_by):
    assert interrupted_by(swallowed_by) == ''


def test_a_kernel_that_is_loaded_when_ctrl_c_comes_is_loaded_whole():
    loading = """
import llvmlite.binding as llvm
llvm.initialize_native_target()
llvm.initialize_native_asmprinter()
machine = llvm.Target.from_default_triple().create_target_machine()
module = llvm.parse_assembly('define i32 @seven() { ret i32 7 }')
engine = llvm.create_mcjit_compiler(module, machine)

def kept(module):
    press()
    print('told whole')

engine.set_object_cache(getbuffer_func=kept)
engine.finalize_object()
"""
    assert interrupted_by(loading) == 'told whole\n'


def interrupted_by(pressing):
    """Press Ctrl-C in the course of some lines of a command; return what it prints until then."""
    script = f"""
import signal, sys, threading
from idem_ros.commands import entry, main
from idem_ros.core import IdemError

def press():
    signal.raise_signal(signal.SIGINT)

def run(args):
    exec({pressing!r}, globals())
    threading.Event().wait(1.0)
    return 0

main.register.run = run
sys.argv = ['idem', 'register', 'a', 'b']
sys.exit(entry.main())
"""
    ended = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=60, check=False
    )
    (said,) = ended.stderr.splitlines()
    assert ended.returncode == 130
    assert 'interrupted' in said
    return ended.stdout
