import hashlib

import pytest
from recordings import scans, write_sqlite3

from idem_ros.recording.folder import fingerprint
from idem_ros.recording.reader import UnreadableRecording
from idem_ros.recording.writer import write_mcap


def test_a_file_has_the_checksum_that_sha256sum_prints(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    write_mcap(path, scans(rng))
    content = path.read_bytes()
    assert fingerprint(path) == {
        'name': 'scans.mcap',
        'size': len(content),
        'sha256': hashlib.sha256(content).hexdigest(),
    }


def test_a_folder_is_told_by_its_recordings_and_not_by_where_it_lies(tmp_path, rng):
    messages = list(scans(rng))
    write_sqlite3(tmp_path / 'a', messages)
    before = fingerprint(tmp_path / 'a')
    (tmp_path / 'a' / 'note.txt').write_text('not recorded')
    (tmp_path / 'a').rename(tmp_path / 'b')
    assert fingerprint(tmp_path / 'b') == {**before, 'name': 'b'}
    (recording,) = (tmp_path / 'b').glob('*.db3')
    recording.rename(recording.with_name('other.db3'))
    assert fingerprint(tmp_path / 'b')['sha256'] != before['sha256']


def test_what_is_no_recording_has_none(tmp_path):
    with pytest.raises(UnreadableRecording, match='does not exist'):
        fingerprint(tmp_path / 'none.mcap')
