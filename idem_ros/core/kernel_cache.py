"""Where compiled kernels are kept: numba's cache, of which only whole files count.

Numba takes any error while it reads or writes its cache for the program's: an empty file, as
power cut off leaves it, or a home that cannot be written ends every start.
"""

# Numba has no types, and calls what is overridden here by position.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
# pyright: reportIncompatibleMethodOverride=false

import logging
import os
import stat
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    NullCache,
    UserProvidedCacheLocator,
    UserWideCacheLocator,
)

DIGEST = sha256().digest_size
OTHERS = stat.S_IWGRP | stat.S_IWOTH
REMEDY = 'set NUMBA_CACHE_DIR to a folder that can be written'
LOG = logging.getLogger(__name__.partition('.')[0])


class _HomeLocator(UserWideCacheLocator):
    """In the user's home, where there is one: without, `~` would be a folder like others."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return the locator of a function; None: there is no home."""
        if not Path(cls(py_func, py_file).get_cache_path()).is_absolute():
            return None
        return super().from_function(py_func, py_file)


class _TemporaryLocator(InTreeCacheLocator):
    """In a folder of temporary files that is this user's alone: what is in it is executed."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(
            temporary_folder('kernels') / self.get_suitable_cache_subpath(py_file)
        )

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return the locator of a function; None: there is no such folder."""
        try:
            return super().from_function(py_func, py_file)
        except OSError:  # there is no folder of temporary files, or this one is somebody else's
            return None


class _InstalledLocator(InTreeCacheLocator):
    """Beside the source, where kernels may lie although nothing can be written."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return the locator of a function; None: its source lies in no file."""
        return cls(py_func, py_file) if Path(py_file).exists() else None


class _Places(CompileResultCacheImpl):
    _locator_classes = [
        UserProvidedCacheLocator,
        InTreeCacheLocator,
        _HomeLocator,
        _TemporaryLocator,
        _InstalledLocator,
    ]


class _Files(IndexDataCacheFile):
    """The files of one kernel, each with a digest at its end.

    What is not whole is as if it were not there, and written anew; so is code that is of another
    source or signature than the index says, as a process leaves it that was killed in between.
    """

    def __init__(
        self, folder: str, name: str, source_stamp: object, installed: str | None = None
    ) -> None:
        super().__init__(folder, name, source_stamp)
        self._installed = _Files(installed, name, source_stamp) if installed else None

    def load(self, key: object) -> Any:
        """Return the code that was kept for a signature; None: there is none of this source."""
        of, code = super().load(key) or (None, None)
        if of == (self._source_stamp, key):
            return code
        return self._installed.load(key) if self._installed else None

    def save(self, key: object, code: object) -> None:
        """Keep the code of a signature, with what it is of."""
        super().save(key, ((self._source_stamp, key), code))

    def _load_index(self) -> dict[Any, str]:
        if not _is_whole(self._index_path):
            return {}
        try:
            return super()._load_index()
        except Exception as error:  # it names what stood elsewhere in an earlier version
            LOG.debug('%s is written anew: %r', self._index_path, error)
            return {}

    def _load_data(self, name: str) -> Any:
        path = self._data_path(name)
        if not _is_whole(path):
            raise FileNotFoundError(path)
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, path: str) -> Generator[BytesIO, None, None]:
        content = BytesIO()
        yield content
        with super()._open_for_write(path) as file:
            file.write(content.getvalue() + sha256(content.getvalue()).digest())


class KernelCache(FunctionCache):
    """Numba's cache of one kernel, which no state of a disk makes fail.

    Kernels are kept where numba keeps them, else in a temporary folder; unless NUMBA_CACHE_DIR
    says where, they are read beside the source, too, where an installation may have brought them.
    """

    _impl_class = _Places
    has_told = False

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)
        locator, name = self._impl.locator, self._impl.filename_base
        installed = _InstalledLocator(py_func, py_func.__code__.co_filename).get_cache_path()
        if isinstance(locator, UserProvidedCacheLocator):
            installed = None
        self._cache_file = _Files(self._cache_path, name, locator.get_source_stamp(), installed)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the kernel for a signature, or None: it is to be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # of what another library makes of what was kept
            LOG.debug('%s is compiled anew: %r', self._name, error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel, where that is possible."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            if not KernelCache.has_told and not isinstance(self._impl.locator, _InstalledLocator):
                KernelCache.has_told = True
                LOG.warning('compiled kernels cannot be kept (%s); %s', error, REMEDY)


def cache_of(py_func: Any) -> Any:
    """Return the cache of a kernel; one that keeps nothing where its source is no file."""
    try:
        return KernelCache(py_func)
    except RuntimeError:  # no locator takes it
        return NullCache()


def kept_in_words(cache: Any) -> str:
    """Say how often kernels with this cache are compiled, and why where it is more than once."""
    locator = getattr(getattr(cache, '_impl', None), 'locator', None)
    if locator is None or isinstance(locator, _InstalledLocator):
        return f'at every start, as they can be kept nowhere; {REMEDY}'
    if isinstance(locator, _TemporaryLocator):
        folder = Path(locator.get_cache_path()).parent
        return f'once, and kept in {folder}, as neither here nor at home can be written; {REMEDY}'
    return 'once'


def temporary_folder(what: str) -> Path:
    """Return a folder for what is kept, which only this user writes; OSError: there is none."""
    folder = Path(tempfile.gettempdir(), f'idem_ros_{what}_{os.geteuid()}')
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & OTHERS:
        raise PermissionError(f'{folder} is not of this user alone')
    return folder


def _is_whole(path: str) -> bool:
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    return sha256(content[:-DIGEST]).digest() == content[-DIGEST:]
