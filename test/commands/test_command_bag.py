import json
from shutil import copy, copytree

import numpy as np
import pytest
from clouds import motion, surface
from scans_in_files import scans, write_kitti_sequence, write_numbered

from idem_ros.commands.main import main
from idem_ros.files.pose_file import write_pose
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.recording.reader import open_recording


@pytest.fixture
def folder(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ('target', 'a', 'b'):
        np.save(f'{name}.npy', surface(rng, 50).astype(np.float32))
        write_pose(f'{name}.txt', motion(rng, 20.0, 1.0))
    return tmp_path


def logged(path='out.mcap'):
    with open_recording(path) as recording:
        return list(recording.messages(recording.topics))


def test_a_recording_holds_the_target_once_and_each_source_with_guess_and_truth(folder):
    argv = ['bag', 'target.npy', 'a.npy', 'b.npy', '--guess', 'a.txt', 'b.txt']
    assert main([*argv, '--truth', 'b.txt', 'a.txt', '--out', 'out.mcap']) == 0
    messages = logged()
    scan = ['/source', '/initial_guess', '/ground_truth']
    assert [topic for topic, _, _ in messages] == ['/target', *scan, *scan]
    stamps = [10**9, *[1_100_000_000] * 3, *[1_200_000_000] * 3]
    assert [stamp_ns(message) for _, _, message in messages] == stamps
    files = ['target.npy', 'a.npy', 'a.txt', 'b.txt', 'b.npy', 'b.txt', 'a.txt']
    for (_, _, message), file in zip(messages, files, strict=True):
        if file.endswith('.npy'):
            np.testing.assert_array_equal(read_points(message).points, np.load(file))
        else:
            np.testing.assert_allclose(matrix_of(message), np.loadtxt(file), atol=1e-12)
            assert (message.header.frame_id, message.child_frame_id) == ('target', 'source')


def test_columns_are_chosen_for_all_files(folder):
    for name in ('target', 'a'):
        cloud = np.load(f'{name}.npy')
        np.savetxt(f'{name}.csv', cloud[:, ::-1], delimiter=',', header='p,q,r', comments='')
    argv = ['bag', 'target.csv', 'a.csv', '--out', 'out.mcap']
    assert main(argv) == 1
    assert main([*argv, '--columns', 'r,q,p']) == 0
    for (_, _, message), name in zip(logged(), ('target', 'a'), strict=True):
        np.testing.assert_allclose(read_points(message).points, np.load(f'{name}.npy'), atol=1e-6)


def test_scans_of_a_kitti_sequence_have_four_columns_whatever_they_look_like(tmp_path, rng):
    poses, clouds = scans(rng)
    write_kitti_sequence(tmp_path / 'drive', rng, poses, clouds)
    rows = rng.normal(size=(300, 4)).astype('<f4')  # might be three columns, five or six
    for path in (tmp_path / 'drive' / 'velodyne').iterdir():
        rows.tofile(path)
    assert main(['bag', str(tmp_path / 'drive'), '--out', str(tmp_path / 'out.mcap')]) == 0
    for topic, _, message in logged(tmp_path / 'out.mcap'):
        if topic in ('/target', '/source'):
            np.testing.assert_array_equal(read_points(message).points, rows[:, :3])


def test_log_times_are_all_different(folder):
    main(['bag', 'target.npy', 'a.npy', 'b.npy', '--guess', 'a.txt', 'b.txt', '--out', 'out.mcap'])
    times = [log_time for _, log_time, _ in logged()]
    assert len(set(times)) == len(times)


def test_guess_and_truth_are_optional(folder):
    assert main(['bag', 'target.npy', 'a.npy', '--out', 'out.mcap']) == 0
    assert [topic for topic, _, _ in logged()] == ['/target', '/source']


def test_the_same_files_give_the_same_bytes(folder):
    argv = ['bag', 'target.npy', 'a.npy', '--guess', 'a.txt', '--out']
    assert main([*argv, 'one.mcap']) == main([*argv, 'two.mcap']) == 0
    assert (folder / 'one.mcap').read_bytes() == (folder / 'two.mcap').read_bytes()


def test_clouds_are_float32_unless_that_would_blur_them(folder):
    np.save('far.npy', np.load('a.npy').astype(np.float64) + (5e5, 5e6, 0.0))
    main(['bag', 'target.npy', 'far.npy', '--out', 'out.mcap'])
    (_, _, near), (_, _, far) = logged()
    assert (near.point_step, far.point_step) == (12, 24)
    np.testing.assert_array_equal(read_points(far).points, np.load('far.npy'))


@pytest.mark.parametrize(
    ('argv', 'code', 'words'),
    [
        (['a.npy', 'b.npy', '--guess', 'a.txt'], 2, '--guess has 1 files for 2 sources'),
        (['a.npy', '--truth', 'a.txt', 'b.txt'], 2, '--truth has 2 files for 1 sources'),
        (['a.npy', '--out', 'out.bag'], 2, 'must end in .mcap'),
        (['a.npy', 'nowhere.ply'], 1, 'nowhere.ply cannot be read'),
        (['a.npy', '--guess', 'nowhere.txt'], 1, 'nowhere.txt cannot be read'),
        (['a.npy', '--out', 'no/out.mcap'], 1, 'does not exist'),
    ],
)
def test_bad_input_gets_one_line_and_leaves_the_old_recording(folder, capsys, argv, code, words):
    (folder / 'out.mcap').write_text('old')
    before = sorted(folder.iterdir())
    assert main(['bag', '--out', 'out.mcap', 'target.npy', *argv]) == code
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
    assert sorted(folder.iterdir()) == before
    assert (folder / 'out.mcap').read_text() == 'old'


@pytest.fixture
def drive(folder, rng):
    write_kitti_sequence(folder / 'drive', rng, *scans(rng))
    return folder / 'drive'


def test_a_folder_of_kitti_becomes_pairs(drive, capsys):
    assert main(['bag', 'drive', '--out', 'out.mcap']) == 0
    assert '3 pairs of 4 scans, each with its truth; guess: the motion before' in (
        capsys.readouterr().out
    )
    assert sum(topic == '/source' for topic, _, _ in logged()) == 3
    assert main(['bag', 'drive', '--start', 'identity', '--out', 'out.mcap']) == 0
    guesses = [matrix_of(message) for topic, _, message in logged() if topic == '/initial_guess']
    np.testing.assert_array_equal(guesses, [np.eye(4)] * 3)


def test_a_folder_of_numbered_clouds_takes_a_trajectory(folder, rng, capsys):
    stamps = [10**9, 2 * 10**9, 3 * 10**9, 4 * 10**9]
    write_numbered(folder / 'scans', *scans(rng), stamps)
    assert main(['bag', 'scans', '--trajectory', 'scans/poses.tum', '--out', 'out.mcap']) == 0
    assert [stamp_ns(m) for topic, _, m in logged() if topic == '/ground_truth'] == stamps[1:]


def test_the_truth_of_real_scans_is_that_of_their_poses(folder, shared_data):
    given = shared_data / 'kitti_odometry_07'
    (folder / 'drive' / 'velodyne').mkdir(parents=True)
    for scan in sorted(given.glob('*.bin')):
        (folder / 'drive' / 'velodyne' / scan.name).symlink_to(scan)
    copy(given / 'calib_Tr.txt', folder / 'drive' / 'calib.txt')
    copy(given / 'poses_07_frames0-2.txt', folder / 'drive' / 'poses.txt')
    assert main(['bag', 'drive', '--out', 'out.mcap']) == 0
    truths = [matrix_of(message) for topic, _, message in logged() if topic == '/ground_truth']
    known = {
        (pair['target'], pair['source']): pair['T_target_source']
        for pair in json.loads((shared_data / 'GROUND_TRUTH.json').read_text())['pairs']
        if pair['item'] == 'kitti_odometry_07'
    }
    for k, truth in enumerate(truths):
        expected = known[f'{k:010d}.bin', f'{k + 1:010d}.bin']
        np.testing.assert_allclose(truth, expected, atol=1e-6)


@pytest.mark.parametrize(
    ('argv', 'code', 'words'),
    [
        (['drive', 'a.npy'], 2, 'drive is a folder'),
        (['drive', '--truth', 'a.txt'], 2, 'drive is a folder'),
        (['a.npy'], 2, 'a.npy is no folder, so it needs at least one SOURCE'),
        (['a.npy', 'b.npy', '--trajectory', 'a.txt'], 2, 'are for a folder'),
        (['a.npy', 'b.npy', '--start', 'identity'], 2, 'are for a folder'),
        (['drive/velodyne'], 1, 'has no folder velodyne'),
        (['drive', '--trajectory', 'a.txt'], 1, 'drive holds no cloud'),
        (['broken'], 1, '000001.bin cannot be read'),
    ],
)
def test_a_folder_that_cannot_be_read_leaves_the_old_recording(
    drive, folder, capsys, argv, code, words
):
    copytree(drive, folder / 'broken')
    (folder / 'broken' / 'velodyne' / '000001.bin').write_bytes(b'123')
    (folder / 'out.mcap').write_text('old')
    before = sorted(folder.iterdir())
    assert main(['bag', '--out', 'out.mcap', *argv]) == code
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
    assert sorted(folder.iterdir()) == before
    assert (folder / 'out.mcap').read_text() == 'old'
