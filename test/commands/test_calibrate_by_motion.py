"""Rigs whose sensors share no view: `idem calibrate` places them by how each of them moved."""

import json
from pathlib import Path

import numpy as np
import pytest
from clouds import error_of, motion
from rigs import off

from idem_ros.commands.main import main
from idem_ros.core.geometry import se3
from idem_ros.recording.messages import cloud_message, tf_message, transform_message
from idem_ros.recording.writer import write_mcap

NAMES = 'ahead', 'behind'
START, STEP = 10**9, 10**8
VOXELS = '--voxel-size', '0.1'


def cave(rng, count):
    """Return points (N, 3) of a bumpy cave around the origin, some 2 m wide, drawn at random."""
    d = rng.normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    bumps = 0.15 * np.sin(6 * d[:, 0] + 1) * np.cos(5 * d[:, 1]) + 0.1 * np.sin(7 * d[:, 2])
    return 2.0 * d * (1 + bumps)[:, None] * (1.2, 1.0, 0.8) + rng.normal(0.0, 0.002, (count, 3))


def rig(rng):
    """Return where both are in the frame of the first: one looks ahead, one behind, tilted."""
    behind = motion(rng, 10.0, 0.0)
    behind[:3, :3] = behind[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    behind[:3, 3] = -0.5, 0.1, -0.2
    return np.array([np.eye(4), behind])


def looks(rng, pose, T):
    """Return what a sensor at T on a rig at a pose sees of the cave: some 110 deg around its x."""
    points = se3.transform_points(se3.inverse(pose @ T), cave(rng, 9000))
    return points[points[:, 0] > 0.57 * np.linalg.norm(points, axis=1)]


def tumbling(k):
    """Return the twist (omega, v) of a drive that turns about all axes, from scan k on."""
    turn = 0.06 * np.array([np.cos(k / 4), np.sin(k / 4), 0.8 * np.cos(k / 3 + 1)])
    return np.r_[turn, 0.02, 0.01, 0.0]


def straight(k):
    """Return the same of a drive without bends."""
    return np.array([0.0, 0.0, 0.0, 0.03, 0.0, 0.0])


def drive(rng, poses, twist, scans=16):
    """Yield (topic, log time, message) of a drive; twist(k) is that from scan k to the next."""
    told = off(rng, poses, 4.0, 0.05)
    transforms = [
        transform_message(T, START, 'base', name) for name, T in zip(NAMES, told, strict=True)
    ]
    yield '/tf_static', START, tf_message(transforms)
    pose = np.eye(4)
    for k in range(scans):
        pose = pose @ se3.exp(twist(k))
        for s, name in enumerate(NAMES):
            points = looks(rng, pose, poses[s])
            stamp = START + k * STEP
            yield f'/{name}', stamp + s, cloud_message(points, stamp, name)


def calibrated(capsys, *argv):
    code = main(['calibrate', *argv, '--json', *VOXELS])
    return code, json.loads(capsys.readouterr().out)


def test_sensors_that_never_see_the_same_are_placed_by_their_motion(tmp_path, rng, capsys):
    poses, path = rig(rng), tmp_path / 'rig.mcap'
    write_mcap(path, drive(rng, poses, tumbling))
    code, record = calibrated(capsys, str(path), '--instants', '2', '--out', str(tmp_path / 'out'))
    behind = record['sensors']['behind']
    assert (code, behind['verdict'], behind['by']) == (0, 'aligned', 'motion')
    degrees, distance = error_of(np.array(behind['T_reference_sensor']), poses[1])
    assert degrees < 1.0
    assert distance < 0.05
    assert any(each.startswith('behind is placed by its motion: ') for each in record['notes'])
    # what was written is a start again
    again = str(tmp_path / 'out' / 'extrinsics.yaml')
    assert main(['calibrate', str(path), '--instants', '1', '--start', again, *VOXELS]) in (0, 1)


def test_a_drive_without_bends_is_said_to_tell_nothing(tmp_path, rng, capsys):
    path = tmp_path / 'rig.mcap'
    write_mcap(path, drive(rng, rig(rng), straight, scans=8))
    code, record = calibrated(capsys, str(path), '--instants', '1')
    behind = record['sensors']['behind']
    assert (code, behind['verdict']) == (1, 'not_converged')
    assert 'by its motion: ' in behind['reason']
    assert 'leaves open where it is along' in behind['reason']


@pytest.mark.parametrize('scans', [2, 4])
def test_a_recording_too_short_for_strides_is_calibrated_by_clouds_alone(
    tmp_path, rng, capsys, scans
):
    path = tmp_path / 'rig.mcap'
    write_mcap(path, drive(rng, rig(rng), tumbling, scans=scans))
    code, record = calibrated(capsys, str(path), '--instants', '1')
    assert code == 1
    assert record['sensors']['behind']['by'] == 'clouds'


def test_folders_of_instants_tell_of_the_motion_between_them(tmp_path, rng, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    poses = rig(rng)
    pose = np.eye(4)
    for k in range(6):
        Path(str(k)).mkdir()
        pose = pose @ se3.exp(2 * tumbling(3 * k))
        for s, name in enumerate(NAMES):
            np.save(f'{k}/{name}.npy', looks(rng, pose, poses[s]))
    rows = [f'  behind: {{parent: ahead, matrix: {off(rng, poses, 4.0, 0.05)[1].tolist()}}}\n']
    Path('start.yaml').write_text('sensors:\n' + ''.join(rows))
    code, record = calibrated(capsys, *map(str, range(6)), '--start', 'start.yaml')
    behind = record['sensors']['behind']
    assert behind['by'] == 'motion'
    assert error_of(np.array(behind['T_reference_sensor']), poses[1])[1] < 0.15
    assert code in (0, 1)
