import os

import numpy as np
import pytest
from recordings import scans

from idem_ros.capsules import Seen, keep
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.pair import Pair
from idem_ros.replay.settings import Settings


@pytest.fixture
def refused():
    (_, _, target), (_, _, source), _, _ = scans(np.random.default_rng(2), n=1)
    return Seen(Pair(target, source, Guess(np.eye(4))), Settings(), None, 'so')


def kept(folder, seen, n, most=100, most_bytes=2**30):
    paths = []
    for k in range(n):
        paths.append(keep(folder, seen, most, most_bytes))
        os.utime(paths[-1], (k, k))  # in the order they were written, whatever the clock says
    return paths


def test_the_oldest_go_where_there_are_too_many(refused, tmp_path):
    folder = tmp_path / 'capsules'
    paths = kept(folder, refused, 5, most=2)
    assert sorted(folder.iterdir()) == sorted(paths[-2:])


def test_the_oldest_go_where_they_are_too_large_together(refused, tmp_path):
    first = keep(tmp_path, refused, 100, 2**30)
    os.utime(first, (0, 0))
    size = first.stat().st_size
    assert kept(tmp_path, refused, 3, most_bytes=2 * size)[-1].exists()
    assert len(list(tmp_path.iterdir())) == 2


def test_one_that_is_too_large_alone_is_kept(refused, tmp_path):
    path = keep(tmp_path, refused, 100, 1)
    assert list(tmp_path.iterdir()) == [path]


def test_nothing_else_is_deleted(refused, tmp_path):
    others = ['notes.txt', 'drive.mcap', 'idem_capsule_1_000_x.mcap.bak', 'idem_capsule_x.mcap']
    for name in others:
        (tmp_path / name).write_text('mine')
    (tmp_path / f'idem_capsule_{0:020d}_000_refused.mcap').symlink_to(tmp_path / 'drive.mcap')
    kept(tmp_path, refused, 3, most=1)
    assert all((tmp_path / name).read_text() == 'mine' for name in others)
    assert len(list(tmp_path.iterdir())) == len(others) + 2


def test_a_name_says_stamp_and_outcome(refused, tmp_path):
    path = keep(tmp_path, refused, 100, 2**30)
    assert path.name == f'idem_capsule_{refused.pair.stamp:020d}_000_refused.mcap'


def test_a_folder_that_cannot_be_made_is_refused_in_words(refused, tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(UnwritableFile, match='cannot make the folder'):
        keep(tmp_path / 'file', refused, 100, 2**30)
    with pytest.raises(UnwritableFile, match='cannot make the folder'):
        keep(tmp_path / 'none' / 'capsules', refused, 100, 2**30)
