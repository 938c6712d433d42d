import pytest

from idem_ros.recording.folder import UnreadableRecording, recording_files, recordings_in


def touch(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def found(folder):
    return [str(path.relative_to(folder)) for path in recordings_in(folder)]


def test_a_file_is_itself(tmp_path):
    touch(tmp_path, 'a.mcap')
    assert recordings_in(tmp_path / 'a.mcap') == [tmp_path / 'a.mcap']


def test_every_kind_is_found_in_every_folder(tmp_path):
    touch(tmp_path, 'b.mcap', 'a.bag', 'deep/er/c.db3', 'notes.txt', 'deep/result.json')
    assert found(tmp_path) == ['a.bag', 'b.mcap', 'deep/er/c.db3']


def test_a_rosbag2_folder_counts_once(tmp_path):
    touch(tmp_path, 'drive/metadata.yaml', 'drive/drive_0.mcap', 'drive/drive_1.mcap')
    touch(tmp_path, 'other/metadata.yaml', 'other/any name.db3', 'other/deeper/x.mcap')
    assert found(tmp_path) == ['drive', 'other']
    assert recordings_in(tmp_path / 'drive') == [tmp_path / 'drive']


def test_a_rosbag2_folder_that_lost_its_metadata_counts_once(tmp_path):
    touch(tmp_path, 'drive/drive_0.mcap', 'drive/drive_1.mcap')
    touch(tmp_path, 'drives/monday.mcap', 'drives/drives_1.mcap')
    assert found(tmp_path) == ['drive', 'drives/drives_1.mcap', 'drives/monday.mcap']


def test_a_folder_of_recordings_that_are_no_parts_of_one_is_not_read_as_one(tmp_path):
    touch(tmp_path, 'x/monday.mcap', 'x/tuesday.mcap', 'x/friday.mcap', 'x/sunday.mcap')
    touch(tmp_path, 'one/run_0.mcap', 'one/run_1.mcap', 'ros1/a_2024-01-02-10-00-00_0.bag')
    touch(tmp_path, 'ros1/a_2024-01-02-10-05-00_1.bag')
    with pytest.raises(
        UnreadableRecording, match=r'\(friday.*monday.*sunday.* and 1 more\)'
    ) as said:
        recording_files(tmp_path / 'x')
    assert f'idem evaluate {tmp_path / "x"}' in str(said.value)
    assert len(recording_files(tmp_path / 'one')) == len(recording_files(tmp_path / 'ros1')) == 2


def test_hidden_files_and_folders_are_left_out(tmp_path):
    touch(tmp_path, '.a.1234.part.mcap', '.trash/b.mcap', 'c.mcap')
    assert found(tmp_path) == ['c.mcap']


def test_nothing_and_nowhere_are_refused(tmp_path):
    with pytest.raises(UnreadableRecording, match='holds no recording'):
        recordings_in(tmp_path)
    with pytest.raises(UnreadableRecording, match='does not exist'):
        recordings_in(tmp_path / 'nowhere')
