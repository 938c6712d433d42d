"""Kernels start whatever became of the files that they are kept in."""

import os
import pickle
import runpy
import tempfile
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

import numba
import pytest

from idem_ros.core.kernel_cache import kept_in_words

NOBODY = 65534
SOURCE = """
from idem_ros.core.jit import compiler

@compiler(nogil=True)
def times(x):
    return {factor} * x
"""


@pytest.fixture
def place():
    """A folder that every user may enter, unlike those of pytest."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.fixture
def start(place, monkeypatch):
    """Return what starts a program with one kernel anew: its result and whether it compiled."""
    monkeypatch.delenv('NUMBA_CACHE_DIR', raising=False)
    file, written = place / 'program.py', {}

    def run(factor=2):
        if (source := SOURCE.format(factor=factor)) != written.get('source'):
            file.write_text(source)
            written['source'] = source
        kernel = runpy.run_path(str(file))['times']
        return kernel(3), not kernel.stats.cache_hits

    return run


@pytest.fixture
def nowhere(place, monkeypatch):
    """Neither beside the program, nor at home, nor among temporary files can be written."""
    (place / '__pycache__').write_text('')
    (place / 'file').write_text('')
    monkeypatch.setenv('HOME', str(place / 'file'))
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.setattr(tempfile, 'tempdir', str(place / 'file'))


@contextmanager
def read_only(folder):
    """Keep this process from writing into a folder; root is not kept from anything."""
    folder.chmod(0o555)
    user = os.geteuid()
    os.seteuid(user or NOBODY)
    try:
        yield
    finally:
        os.seteuid(user)
        folder.chmod(0o755)


def kept(folder, kind):
    (file,) = folder.rglob(f'*.{kind}')
    return file


def cut(content):
    return content[: len(content) // 2]


def zeroed(content):
    return bytes(len(content))


def page_zeroed(content):
    middle = len(content) // 2
    return content[:middle] + bytes(64) + content[middle + 64 :]


def empty(content):
    return b''


def of_another_numba(content):
    return pickle.dumps('0.1') + content[20:]


def grown(content):
    return content + b'more'


@pytest.mark.parametrize('kind', ['nbi', 'nbc'])
@pytest.mark.parametrize(
    'damaged', [empty, cut, zeroed, page_zeroed, of_another_numba, grown], ids=lambda f: f.__name__
)
def test_damaged_file_is_compiled_anew_and_replaced(start, place, kind, damaged):
    assert start() == (6, True)
    assert start() == (6, False)
    file = kept(place, kind)
    file.write_bytes(damaged(file.read_bytes()))
    assert start() == (6, True)
    assert start() == (6, False)


def test_an_index_that_names_what_an_earlier_version_had_is_written_anew(start, place):
    assert start() == (6, True)
    index = kept(place, 'nbi')
    version = pickle.dumps(numba.__version__)
    content = version + b'\x80\x04\x8c\x0cgone_with_it\x8c\x01x\x93.'  # gone_with_it.x
    index.write_bytes(content + sha256(content).digest())
    assert start() == (6, True)
    assert start() == (6, False)


@pytest.mark.parametrize('kind', ['nbi', 'nbc'])
def test_folder_in_the_place_of_a_file_is_done_without(start, place, kind):
    start()
    file = kept(place, kind)
    file.unlink()
    file.mkdir()
    assert start() == (6, True)


def test_missing_file_is_compiled_anew(start, place):
    start()
    kept(place, 'nbc').unlink()
    assert start() == (6, True)
    assert start() == (6, False)


def test_code_of_the_source_before_is_not_run_where_the_index_is_newer(start, place):
    start(factor=2)
    code = kept(place, 'nbc')
    older = code.read_bytes()
    assert start(factor=5) == (15, True)
    code.write_bytes(older)
    assert start(factor=5) == (15, True)


def test_without_a_place_to_write_it_is_compiled_and_the_remedy_named(start, place, nowhere):
    assert start() == (6, True)
    assert start() == (6, True)
    kernel = runpy.run_path(str(place / 'program.py'))['times']
    said = kept_in_words(kernel._cache)
    assert 'at every start' in said
    assert 'set NUMBA_CACHE_DIR to a folder that can be written' in said


def test_without_a_home_it_is_kept_in_a_temporary_folder_of_the_user(
    start, place, nowhere, monkeypatch
):
    (place / 'tmp').mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(place / 'tmp'))
    assert start() == (6, True)
    assert start() == (6, False)
    (folder,) = (place / 'tmp').iterdir()
    assert folder.stat().st_mode & 0o077 == 0


def test_temporary_folder_that_others_may_write_is_not_trusted(start, place, nowhere, monkeypatch):
    (place / 'tmp').mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(place / 'tmp'))
    folder = place / 'tmp' / f'idem_ros_kernels_{os.getuid()}'
    folder.mkdir()
    folder.chmod(0o777)
    assert start() == (6, True)
    assert not list(folder.iterdir())


def test_kernels_that_an_installation_brought_are_read_where_nothing_can_be_written(
    start, place, nowhere
):
    (place / '__pycache__').unlink()
    start()
    with read_only(place / '__pycache__'):
        assert start() == (6, False)


def test_where_the_environment_names_a_folder_kernels_are_read_there_only(
    start, place, monkeypatch
):
    start()
    monkeypatch.setattr('numba.config.CACHE_DIR', str(place / 'elsewhere'))
    assert start() == (6, True)
    assert start() == (6, False)


def test_home_that_is_unset_and_unknown_makes_no_folder_named_after_it(
    start, place, nowhere, monkeypatch
):
    monkeypatch.setenv('HOME', '~')
    monkeypatch.chdir(place)
    start()
    assert not (place / '~').exists()
