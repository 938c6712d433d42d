import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clouds import error_of
from rigs import SENSORS, extrinsics, off, sightings
from rosbags.rosbag2 import Writer

from idem_ros.calibration.initial_extrinsics import read_starts, starts_of
from idem_ros.commands.main import main
from idem_ros.core.geometry.se3 import inverse
from idem_ros.files.pose_file import write_poses
from idem_ros.recording.messages import cloud_message, tf_message, transform_message, typestore
from idem_ros.recording.writer import write_mcap

VOXELS = '--voxel-size', '0.05'
START, STEP = 10**9, 10**8


@pytest.fixture
def truth(tmp_path, rng, monkeypatch):
    """Two folders of three clouds, and starts, in the working folder."""
    monkeypatch.chdir(tmp_path)
    poses = extrinsics(rng)
    for k, row in enumerate(sightings(rng, poses, instants=2)):
        Path(str(k)).mkdir()
        for name, points in zip(SENSORS, row, strict=True):
            np.save(f'{k}/{name}.npy', points)
    starts = off(rng, poses, 5.0, 0.05)
    rows = [
        f'  {name}: {{parent: top, matrix: {T.tolist()}}}\n'
        for name, T in zip(SENSORS[1:], starts[1:], strict=True)
    ]
    Path('start.yaml').write_text('sensors:\n' + ''.join(rows))
    write_poses('reversed.txt', [starts[k] for k in (1, 2, 0)])
    return dict(zip(SENSORS, poses, strict=True))


def near(pose, truth):
    degrees, distance = error_of(pose, truth)
    return degrees < 0.5 and distance < 0.01


def recording(rng, poses, instants=3, late=0, told=None, silent=(), frames=SENSORS):
    """Yield (topic, log time, message) of a rig that stands."""
    if told is not None:
        transforms = [
            transform_message(T, START, 'base', name)
            for name, T in zip(SENSORS, told, strict=True)
        ]
        yield '/tf_static', START, tf_message(transforms)
    row = sightings(rng, poses)[0]
    for k in range(instants):
        for s, points in enumerate(row):
            stamp = START + k * STEP + s * late
            if SENSORS[s] not in silent:
                noisy = points + rng.normal(0.0, 0.001, points.shape)
                yield f'/{SENSORS[s]}', stamp + s, cloud_message(noisy, stamp, frames[s])


def test_folders_of_instants_are_calibrated_and_written_whole(truth, capsys):
    assert main(['calibrate', '0', '1', '--start', 'start.yaml', '--out', 'rig', *VOXELS]) == 0
    out = capsys.readouterr().out
    assert out.startswith('2 instants, voxels of 0.05; each sensor in the frame of left:')
    assert out.count('aligned') == 3
    assert sorted(p.name for p in Path('rig').iterdir()) == sorted(
        ['extrinsics.yaml', 'joints.urdf', 'publish.sh', 'overlay.png']
    )
    assert Path('rig/overlay.png').read_bytes().startswith(b'\x89PNG')
    assert not list(Path().glob('.*.part*'))


def test_what_is_written_is_a_start_again(truth):
    common = ['--reference', 'top', *VOXELS]
    main(['calibrate', '0', '1', '--start', 'start.yaml', '--out', 'rig', *common])
    poses = starts_of(read_starts('rig/extrinsics.yaml', SENSORS), SENSORS)
    assert all(near(T, truth[name]) for name, T in zip(SENSORS, poses, strict=True))
    again = ['0', '--start', 'rig/extrinsics.yaml', '--json', *common]
    assert main(['calibrate', *again]) == 0


def test_urdf_and_publishers_say_the_same(truth):
    main(
        ['calibrate', '0', '--start', 'start.yaml', '--reference', 'top', '--out', 'rig', *VOXELS]
    )
    urdf = f'<robot name="rig">{Path("rig/joints.urdf").read_text()}</robot>'
    Path('rig.urdf').write_text(urdf)
    assert near(read_starts('rig.urdf', SENSORS).pose('top', 'left'), truth['left'])
    line = next(each for each in Path('rig/publish.sh').read_text().splitlines() if 'left' in each)
    x, y, z = (float(re.search(rf'--{axis} (\S+)', line)[1]) for axis in 'xyz')
    assert np.linalg.norm(np.array([x, y, z]) - truth['left'][:3, 3]) < 0.01
    assert '--frame-id top --child-frame-id left' in line


def test_where_no_sensor_could_be_calibrated_every_file_says_so(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in SENSORS:
        np.savetxt(f'{name}.xyz', rng.uniform(0.0, 3.0, (1000, 3)))
    files = [f'{name}.xyz' for name in SENSORS]
    assert main(['calibrate', *files, '--out', 'rig', *VOXELS]) == 1
    assert Path('rig/joints.urdf').read_text() == '<!-- no sensor could be calibrated -->\n'
    assert Path('rig/publish.sh').read_text().splitlines() == ['#!/bin/sh', 'wait']


def test_one_file_a_sensor_is_one_instant(truth, capsys):
    files = [f'0/{name}.npy' for name in SENSORS]
    names = ['--names', 'front', 'side', 'rear', '--reference', 'front']
    write_poses('starts.txt', [truth[name] for name in SENSORS])
    assert main(['calibrate', *files, '--start', 'starts.txt', '--json', *names, *VOXELS]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record['reference'] == 'front'
    assert near(np.array(record['sensors']['side']['T_reference_sensor']), truth['left'])
    assert record['sensors']['rear']['instants'] == 1


def test_poses_are_in_the_order_of_the_sensors(truth, capsys):
    argv = ['calibrate', '0', '--start', 'reversed.txt', '--json', *VOXELS]
    assert main(argv) == 0  # left, right, top: by the names of the files
    record = json.loads(capsys.readouterr().out)
    T = np.array(record['sensors']['right']['T_reference_sensor'])
    assert near(T, inverse(truth['left']) @ truth['right'])


def test_a_recording_starts_from_tf_static(tmp_path, rng, capsys):
    poses = extrinsics(rng)
    path = tmp_path / 'rig.mcap'
    told = off(rng, poses, 5.0, 0.05)
    write_mcap(path, recording(rng, poses, late=4_000_000, told=told))
    argv = ['calibrate', str(path), '--reference', '/top', '--instants', '2', '--json', *VOXELS]
    assert main(argv) == 0
    record = json.loads(capsys.readouterr().out)
    for name, T in zip(SENSORS, poses, strict=True):
        assert near(np.array(record['sensors'][name]['T_reference_sensor']), T)
    assert {each['parent'] for each in record['transforms']} == {'base'}
    assert 'right measures +8.0 ms after top' in record['notes']
    assert [len(each['twist']) for each in record['instants']] == [6, 6]


def test_a_silent_topic_is_named_and_the_rest_is_calibrated(tmp_path, rng, capsys):
    poses = extrinsics(rng)
    path = tmp_path / 'rig.mcap'
    messages = list(recording(rng, poses, told=poses))
    far = cloud_message(np.ones((9, 3)), START + 60 * 10**9, 'right')
    kept = [each for each in messages if each[0] != '/right']
    write_mcap(path, [*kept, ('/right', START + 10**10, far)])
    assert main(['calibrate', str(path), '--reference', '/top', *VOXELS]) == 1
    out = capsys.readouterr().out
    assert '/right has no cloud within a period, 0.1 s, of the reference at 2 of 2' in out
    assert 'right is not calibrated: it has no cloud' in out
    assert re.search(r'left .* aligned', out)


def test_a_topic_without_a_message_is_left_out_and_the_exit_code_says_so(tmp_path, rng, capsys):
    poses = extrinsics(rng)
    with Writer(tmp_path / 'rig', version=9) as writer:
        connections = {}
        for topic, log_time, message in recording(rng, poses, told=poses):
            if topic not in connections:
                kind = message.__msgtype__
                connections[topic] = writer.add_connection(topic, kind, typestore=typestore())
            if topic != '/right':
                raw = typestore().serialize_cdr(message, message.__msgtype__)
                writer.write(connections[topic], log_time, raw)
    assert main(['calibrate', str(tmp_path / 'rig'), '--reference', '/top', *VOXELS]) == 1
    out = capsys.readouterr().out
    assert 'note: /right is silent, and is left out' in out
    assert re.search(r'left .* aligned', out)


@pytest.mark.parametrize(
    ('options', 'argv', 'words'),
    [
        ({}, ['--topics', '/top', 'top'], '/top is given for two sensors'),
        ({}, ['--topics', '/top', '/front'], "no topic '/front'"),
        ({}, ['--topics', '/top'], '1 topics of PointCloud2'),
        ({'frames': ('lidar',) * 3}, [], "'lidar': tell them apart by --names"),
        ({'told': 3}, ['--names', 'top', 'left', 'rear'], "nothing of the frame 'rear'"),
        ({}, ['--instants', '0'], 'from 1'),
        ({}, ['--start', 'none.urdf'], 'none.urdf cannot be read'),
        ({'silent': ('left', 'right')}, [], '1 topics'),
        ({'late': 10**10, 'instants': 2}, [], 'within a period'),
    ],
)
def test_a_recording_that_is_no_rig_is_refused_in_a_line(
    tmp_path, rng, capsys, options, argv, words
):
    poses = extrinsics(rng)
    told = off(rng, poses, 5.0, 0.05) if options.pop('told', None) else None
    write_mcap(tmp_path / 'rig.mcap', recording(rng, poses, told=told, **options))
    out = tmp_path / 'out'
    assert main(['calibrate', str(tmp_path / 'rig.mcap'), '--out', str(out), *argv]) in (1, 2)
    error = capsys.readouterr().err
    assert words in error
    assert error.count('\n') == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['0', '0/top.npy'], 'is a folder and 0/top.npy is none'),
        (['0', '0'], '0 is given twice'),
        (['0/top.npy'], 'there is one sensor'),
        (['0/top.npy', '1/top.npy'], 'the same name'),
        (['empty', '0'], 'holds no cloud'),
        (['0', '--reference', 'rear'], 'there are left, right, top'),
        (['0', '--names', 'a', 'b'], 'one each for left, right, top'),
        (['0', '--topics', '/a', '/b'], 'of a recording'),
        (['copies'], 'same points'),
        (['wide'], 'the same unit'),
        (['0', '--out', '1'], 'not empty'),
        (['none.npy', '0/top.npy'], 'none.npy'),
    ],
)
def test_files_that_are_no_rig_are_refused_in_a_line(truth, capsys, argv, words):
    for name in ('empty', 'copies', 'wide'):
        Path(name).mkdir()
    points = np.load('0/top.npy')
    for name, factor in (('copies', 1.0), ('wide', 1000.0)):
        np.save(f'{name}/top.npy', points)
        np.save(f'{name}/left.npy', factor * points)
    assert main(['calibrate', *argv]) in (1, 2)
    error = capsys.readouterr().err
    assert words in error
    assert error.count('\n') == 1


def test_a_cloud_that_cannot_be_read_is_named_and_the_rest_is_calibrated(truth, capsys):
    Path('0/right.npy').write_bytes(b'')
    argv = ['calibrate', '0', '--start', 'start.yaml', '--reference', 'top', *VOXELS]
    assert main(argv) == 1
    out = capsys.readouterr().out
    assert 'note: right is left out: 0/right.npy' in out
    assert 'right is not calibrated' in out


def test_where_no_cloud_can_be_read_the_files_are_named_first(truth, capsys):
    for name in ('left', 'right'):
        Path(f'0/{name}.npy').write_bytes(b'')
    assert main(['calibrate', '0', '--start', 'start.yaml', '--reference', 'top', *VOXELS]) == 1
    error = capsys.readouterr().err
    assert error.startswith('idem: error: left is left out: 0/left.npy')
    assert '--reference' not in error


def test_fewer_instants_than_asked_for_are_said_and_truth_is_compared(tmp_path, rng, capsys):
    poses, path = extrinsics(rng), tmp_path / 'rig.mcap'
    true = [
        ('/ground_truth', START + k, transform_message(T, START, 'top', name))
        for k, (name, T) in enumerate(zip(SENSORS[1:], poses[1:], strict=True))
    ]
    write_mcap(path, [*recording(rng, poses, told=poses), *true])
    assert main(['calibrate', str(path), '--reference', '/top', '--instants', '9', *VOXELS]) == 0
    out = capsys.readouterr().out
    assert 'note: 9 instants are asked for, and there are 2' in out
    assert re.search(r'note: left is 0\.00\d+ m and .* where the recording says', out)
    assert main(['truth', str(path), '--out', str(tmp_path / 'truth.tum')]) == 1
    assert '--out FILE.yaml' in capsys.readouterr().err
    assert main(['truth', str(path), '--out', str(tmp_path / 'truth.yaml')]) == 0
    assert 'truth.yaml: 2 poses' in capsys.readouterr().out
    told = starts_of(read_starts(tmp_path / 'truth.yaml', SENSORS), SENSORS)
    np.testing.assert_allclose(told, poses, atol=1e-8)


def test_two_topics_of_the_same_points_are_refused(tmp_path, rng, capsys):
    poses, path = extrinsics(rng), tmp_path / 'rig.mcap'
    messages = list(recording(rng, poses, told=poses))
    copies = [
        ('/again', time, replace(cloud, header=replace(cloud.header, frame_id='again')))
        for topic, time, cloud in messages
        if topic == '/left'
    ]
    write_mcap(path, [*messages, *copies])
    places = ', '.join(f'{name}: {{parent: base}}' for name in (*SENSORS, 'again'))
    (tmp_path / 'start.yaml').write_text(f'sensors: {{{places}}}')
    names = ['--start', str(tmp_path / 'start.yaml')]
    assert main(['calibrate', str(path), *names, *VOXELS]) == 1
    assert 'left holds the same points as again' in capsys.readouterr().err


def test_a_sensor_that_has_moved_since_it_was_calibrated_is_named(truth, capsys):
    common = ['--reference', 'top', *VOXELS]
    main(['calibrate', '0', '--start', 'start.yaml', '--out', 'rig', *common])
    capsys.readouterr()
    points = np.load('1/left.npy')
    np.save('1/left.npy', points + (0.04, 0.0, 0.0))
    main(['calibrate', '1', '--start', 'rig/extrinsics.yaml', *common])
    notes = [line for line in capsys.readouterr().out.splitlines() if 'has moved' in line]
    assert len(notes) == 1
    assert notes[0].startswith('note: left has moved by 0.0')
