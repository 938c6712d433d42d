"""Replays against a map from a file."""

import json
import shutil

import numpy as np
import pytest
from terrain import guess_near, points_around, scan_at

from idem_ros.commands.main import main
from idem_ros.maps.tile_writer import cut_map
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.clouds_again import clouds_of
from idem_ros.replay.provenance import ForbiddenRecording
from idem_ros.results.result_file import read_result

STEP = 10**8


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A map of 160 m as a file and as tiles, and scans of 35 m in it."""
    folder, rng = tmp_path_factory.mktemp('map'), np.random.default_rng(3)
    np.save(folder / 'map.npy', points_around((0.0, 0.0), 80.0, rng))
    cut_map(folder / 'map.npy', folder / 'tiles', 40)
    write_mcap(folder / 'run.mcap', list(_scans(rng)))
    return folder


def _scans(rng):
    for i in range(1, 4):
        points, truth = scan_at((5.0 * i, -3.0 * i), 35.0, rng)
        stamp = i * STEP
        yield '/source', stamp, cloud_message(points, stamp, 'lidar')
        poses = {'/initial_guess': guess_near(truth, rng), '/ground_truth': truth}
        for k, (topic, pose) in enumerate(poses.items(), start=1):
            yield topic, stamp + k, transform_message(pose, stamp, 'map', 'lidar')


def frames_of(folder, target_file, *options):
    out = folder / 'result.json'
    argv = ['replay', str(folder / 'run.mcap'), '--target-file', str(target_file)]
    code = main([*argv, '--voxel-size', '0.5', '--json', str(out), *options])
    return code, json.loads(out.read_text())


def test_scans_are_found_in_a_map_from_a_file(folder):
    code, result = frames_of(folder, folder / 'map.npy')
    assert code == 0
    assert len(result['frames']) == 3
    for frame in result['frames']:
        assert frame['verdict'] == 'aligned'
        assert frame['translation_error_m'] < 0.03
        assert frame['overlap'] > 0.7
        assert frame['target_frame'] == 'map'
        assert 0 < frame['points_target'] < 60_000
    assert result['made_by']['topics']['target'] is None
    assert result['made_by']['parameters']['target_file'] == str(folder / 'map.npy')


def test_tiles_give_the_same_results_as_the_file(folder):
    _, of_file = frames_of(folder, folder / 'map.npy')
    _, of_tiles = frames_of(folder, folder / 'tiles')
    for one, other in zip(of_file['frames'], of_tiles['frames'], strict=True):
        np.testing.assert_allclose(one['T_target_source'], other['T_target_source'], atol=1e-4)
        assert one['verdict'] == other['verdict']


def test_who_starts_far_off_is_lost_only_after_a_usable_result(folder):
    options = '--initial-guess-type', 'last', '--initial-guess-lost-after', '0.05'
    _, result = frames_of(folder, folder / 'map.npy', *options)
    assert result['frames'][0]['translation_error_m_before'] > 3.0
    usable = [frame['verdict'] == 'aligned' for frame in result['frames']]
    lost = ['lost' in frame for frame in result['frames']]
    assert lost == [not ok and any(usable[:i]) for i, ok in enumerate(usable)]


def test_a_sensor_gone_wrong_is_lost_and_a_note_says_since_when_and_why(folder, tmp_path):
    rng = np.random.default_rng(9)
    messages = []
    for i, x in enumerate((0.0, 5.0, 10.0, 15.0), start=1):
        scan, truth = scan_at((x, 5.0), 35.0, rng)
        scan = scan if i < 3 else rng.uniform(-30.0, 30.0, (5000, 3))
        messages.append(('/source', i * STEP, cloud_message(scan, i * STEP, 'lidar')))
        if i == 1:
            first = transform_message(guess_near(truth, rng), 0, 'map', 'lidar')
            messages.insert(0, ('/initial_guess', 1, first))
    write_mcap(tmp_path / 'off.mcap', messages)
    options = '--initial-guess-type', 'last', '--initial-guess-lost-after', '0.05'
    argv = ['replay', str(tmp_path / 'off.mcap'), '--target-file', str(folder / 'map.npy')]
    out = tmp_path / 'r.json'
    assert main([*argv, '--voxel-size', '0.5', *options, '--json', str(out)]) == 0
    result = json.loads(out.read_text())
    lost = [i for i, frame in enumerate(result['frames']) if 'lost' in frame]
    assert lost
    assert lost[-1] == 3
    note = next(each for each in result['notes'] if 'were lost' in each)
    assert note.startswith(f'{len(lost)} sources were lost; the first: no usable result for')


@pytest.mark.parametrize(
    ('options', 'code', 'says'),
    [
        (['--target-file', 'none.pcd'], 1, 'none.pcd is not there'),
        (['--target-file', 'run.mcap'], 1, 'suffix must be one of'),
        (['--target-file', 'map.npy', '--target-frame', 'a b'], 2, "target_frame is 'a b'"),
        (['--target-file', 'map.npy', '--target-topic', '/target'], 1, 'choose one'),
        (['--target-file', 'map.npy', '--target-frame', 'odom'], 1, "'odom'"),
        (['--target-file', 'km.npy'], 1, 'is the map in kilometres'),
        (['--target-file', 'mm.npy'], 1, 'is it in millimetres?'),
    ],
)
def test_a_map_that_cannot_be_used_is_said_in_one_line(
    folder, options, code, says, capsys, monkeypatch
):
    monkeypatch.chdir(folder)
    points = np.load('map.npy')
    np.save('km.npy', points / 1000.0)
    np.save('mm.npy', points * 1000.0)
    assert main(['replay', 'run.mcap', '--voxel-size', '0.5', *options]) == code
    said = capsys.readouterr().err.strip().splitlines()
    assert says in said[-1]
    assert 'Traceback' not in '\n'.join(said)


def test_a_scan_outside_of_the_map_is_separated(folder, tmp_path):
    np.save(tmp_path / 'elsewhere.npy', np.load(folder / 'map.npy') + (5000.0, 0.0, 0.0))
    code, result = frames_of(folder, tmp_path / 'elsewhere.npy')
    assert code == 1
    assert {frame['verdict'] for frame in result['frames']} == {'separated'}


def test_a_result_against_a_map_is_repeated_and_its_clouds_are_found_again(folder, capsys):
    frames_of(folder, folder / 'map.npy')
    result = str(folder / 'result.json')
    assert main(['replay', '--again', result, '--recordings-under', str(folder)]) == 0
    assert '3 of 3 frames agree bit for bit' in capsys.readouterr().out
    for _, target, source in clouds_of(read_result(result), [0, 2]):
        assert len(source) < len(target) < 2 * len(np.load(folder / 'map.npy'))


def test_a_map_outside_of_the_folder_that_recordings_must_lie_in_is_not_opened(
    folder, tmp_path, capsys
):
    (tmp_path / 'map.npy').write_bytes((folder / 'map.npy').read_bytes())
    frames_of(folder, tmp_path / 'map.npy')
    argv = ['replay', '--again', str(folder / 'result.json')]
    assert main([*argv, '--recordings-under', str(folder)]) == 1
    assert 'is of the map' in capsys.readouterr().err
    with pytest.raises(ForbiddenRecording, match='is of the map'):
        next(clouds_of(read_result(folder / 'result.json'), [0], folder))


@pytest.mark.parametrize('of', ['map.npy', 'tiles'])
def test_a_result_is_repeated_in_the_same_map_only(folder, tmp_path, of, capsys):
    moved = tmp_path / of
    copy = shutil.copytree if (folder / of).is_dir() else shutil.copy
    copy(folder / of, moved)
    result = str(tmp_path / 'result.json')
    argv = ['replay', str(folder / 'run.mcap'), '--target-file', str(moved), '--every', '3']
    assert main([*argv, '--voxel-size', '0.5', '--json', result]) == 0
    then = read_result(result).made_by['map']
    assert then['name'] == of
    assert main(['replay', '--again', result]) == 0
    capsys.readouterr()
    spoilt = moved if moved.is_file() else next(moved.glob('*.pcd'))
    spoilt.write_bytes(spoilt.read_bytes()[:-1] + b'\x01')
    assert main(['replay', '--again', result]) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert f'the map {of} is not what {result} was made of' in error
    assert then['sha256'] in error
    spoilt.unlink()
    assert main(['replay', '--again', result]) == 1
    error = capsys.readouterr().err
    assert ('neither at' if spoilt == moved else then['sha256']) in error
    assert 'Traceback' not in error


def test_a_map_beside_its_result_is_found(folder, tmp_path):
    shutil.copy(folder / 'map.npy', tmp_path / 'elsewhere.npy')
    argv = ['replay', str(folder / 'run.mcap'), '--voxel-size', '0.5', '--every', '3']
    (tmp_path / 'results').mkdir()
    result = str(tmp_path / 'results' / 'r.json')
    argv += ['--target-file', str(tmp_path / 'elsewhere.npy'), '--json', result]
    assert main(argv) == 0
    (tmp_path / 'elsewhere.npy').rename(tmp_path / 'results' / 'elsewhere.npy')
    assert main(['replay', '--again', result]) == 0
    ((_, target, _),) = clouds_of(read_result(result), [0])
    assert len(target) > 1000
