import errno
import os
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.replay import spool
from idem_ros.replay.spool import Spool


def test_what_was_put_in_comes_back_in_its_order_bit_for_bit(rng):
    arrays = [rng.normal(size=(k, 3)) for k in range(4)]
    arrays[1][0, 0] = -0.0
    spooled = Spool(arrays[:2])
    spooled.append(arrays[2])
    assert [each.tobytes() for each in spooled] == [each.tobytes() for each in arrays[:3]]
    spooled.append(arrays[3])
    assert (len(spooled), spooled[-1].tobytes()) == (4, arrays[3].tobytes())
    assert [len(each) for each in spooled[1:3]] == [1, 2]
    with pytest.raises(IndexError):
        spooled[4]


def test_it_may_be_read_several_times_at_once_and_written_between():
    spooled = Spool('abc')
    first, second = iter(spooled), iter(spooled)
    assert [next(first), next(second), next(first)] == ['a', 'a', 'b']
    spooled.append('d')
    assert (list(first), list(second)) == (['c', 'd'], ['b', 'c', 'd'])
    assert not Spool()


def test_nothing_of_it_is_ever_to_be_seen_in_its_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    spooled = Spool(range(100))
    (link,) = _open_files(tmp_path)  # it is there, and has no name
    assert list(tmp_path.iterdir()) == []
    del spooled
    assert (_open_files(tmp_path), '(deleted)' in link) == ([], True)


def _open_files(folder):
    links = []
    for number in Path('/proc/self/fd').iterdir():
        with suppress(OSError):  # that of the listing itself
            links.append(str(number.readlink()))
    return [link for link in links if link.startswith(str(folder))]


def test_a_disk_that_gets_full_names_the_folder_and_what_was_written_stays(monkeypatch):
    write, left = os.pwrite, [5]

    def filling(number, content, place):
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = bytes(content[: left[0]])
        left[0] -= len(taken)
        return write(number, taken, place)

    spooled = Spool(['whole'])
    monkeypatch.setattr(os, 'pwrite', filling)
    with pytest.raises(UnwritableFile, match='No space left on device; .* TMPDIR'):
        spooled.append('cut off')
    left[0] = 10**6
    spooled.append(np.float64(2.0))
    assert list(spooled) == ['whole', 2.0]


def test_a_folder_that_refuses_files_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'none'))
    with pytest.raises(UnwritableFile, match=r'to .*none: No such file'):
        spool.Spool()
