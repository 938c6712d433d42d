"""What a replay finds, on disk instead of in memory: as it comes, and read back in its order."""

import os
import pickle
from array import array
from collections.abc import Sequence
from itertools import pairwise
from tempfile import TemporaryFile, gettempdir

from idem_ros.files.atomic_file import UnwritableFile


class Spool(Sequence):
    """A sequence of what can be pickled; of each, 8 bytes stay in memory.

    It lies in the folder of temporary files (TMPDIR), in a file without a name: however the
    process ends, nothing is left of it.

    Args:
        records: those to begin with.

    Raises:
        UnwritableFile: that folder is full, or refuses files; so does `append`.
    """

    def __init__(self, records=()):
        self._ends = array('q', [0])
        try:
            self._file = TemporaryFile(buffering=0)  # noqa: SIM115 - open as long as we live
        except OSError as error:
            raise _unwritable(error) from error
        for record in records:
            self.append(record)

    def append(self, record):
        """Write a record behind the others."""
        content, end = memoryview(pickle.dumps(record)), self._ends[-1]
        try:
            while content:  # a disk that gets full takes a part, and then nothing
                written = os.pwrite(self._file.fileno(), content, end)
                content, end = content[written:], end + written
        except OSError as error:
            raise _unwritable(error) from error
        self._ends.append(end)

    def __len__(self):
        """Return how many records there are."""
        return len(self._ends) - 1

    def __getitem__(self, index):
        """Return a record, read anew, or a list of those of a slice."""
        found = range(len(self))[index]
        if isinstance(found, range):
            return [self[i] for i in found]
        return self._read(self._ends[found], self._ends[found + 1])

    def __iter__(self):
        """Yield one record after the other."""
        for begin, end in pairwise(self._ends):
            yield self._read(begin, end)

    def __del__(self):
        """Give the disk back."""
        if hasattr(self, '_file'):
            self._file.close()

    def _read(self, begin, end):
        return pickle.loads(os.pread(self._file.fileno(), end - begin, begin))


def _unwritable(error):
    return UnwritableFile(
        f'cannot write what is found to {gettempdir()}: {error.strerror or error}; '
        'the environment variable TMPDIR names another folder for temporary files'
    )
