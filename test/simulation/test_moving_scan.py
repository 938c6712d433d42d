import hashlib

import numpy as np
import pytest
from conftest import ROOT

from idem_ros.commands.main import main
from idem_ros.core import InvalidConfig, undistort
from idem_ros.core.geometry import se3
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.recording.reader import open_recording
from idem_ros.simulation.drive import moving_drive
from idem_ros.simulation.lidar import Lidar, moving_scan, scan
from idem_ros.simulation.street import street
from idem_ros.simulation.surfaces import Scene, box
from idem_ros.simulation.tunnel import tunnel

FAST = ROOT / 'bags' / 'fast.mcap'
ROOM = Scene(boxes=[box((-9, -7, -2), (8, 6, 3))])
EXACT = Lidar(range_noise_m=0.0, dropout=0.0, min_range_m=0.0)
TWIST = np.array([10.0, 1.0, -0.5, 0.2, -0.1, 1.6])


def to_walls(points):
    return np.abs(np.concatenate([points - (-9, -7, -2), points - (8, 6, 3)], axis=1)).min(axis=1)


def test_a_moving_scan_lies_on_the_surfaces_once_its_motion_is_undone():
    T = se3.exp(np.array([0.05, -0.1, 2.0, 1.0, -1.0, 0.3]))
    points, times = moving_scan(ROOM, T, TWIST, 0.1, EXACT, np.random.default_rng(0))
    assert times.min() == 0.0
    assert times.max() == pytest.approx(0.1 * (1 - 1 / EXACT.azimuth_steps))
    undone = se3.transform_points(T, undistort(points, times, TWIST))
    assert to_walls(undone).max() < 1e-9
    assert np.median(to_walls(se3.transform_points(T, points))) > 0.02


def test_a_sensor_that_stands_still_sees_the_same_as_in_a_scan():
    lidar, T = Lidar(), se3.exp(np.array([0.0, 0.1, 1.0, 0.5, 0.2, 0.1]))
    points, _ = moving_scan(ROOM, T, np.zeros(6), 0.1, lidar, np.random.default_rng(5))
    assert np.array_equal(points, scan(ROOM, T, lidar, np.random.default_rng(5)))


def test_the_pose_at_every_instant_of_a_drive_follows_from_its_twists():
    rng = np.random.default_rng(1)
    poses, twists = moving_drive(street(rng), 20, rng, 12.0, np.radians(80), 0.1)
    for T, twist, after in zip(poses[:-1], twists, poses[1:], strict=True):
        assert T @ se3.exp(0.1 * twist[[3, 4, 5, 0, 1, 2]]) == pytest.approx(after, abs=1e-12)
    speeds = np.linalg.norm(twists[:, :3], axis=1)
    assert speeds == pytest.approx(12.0, rel=0.05)
    assert np.degrees(np.abs(twists[:, 5]).max()) == pytest.approx(80.0, rel=0.2)


def test_a_route_too_short_for_the_drive_is_refused():
    rng = np.random.default_rng(1)
    with pytest.raises(InvalidConfig, match='200 sweeps of 0.1 s at 20 m/s take 400 m; the route'):
        moving_drive(street(rng), 200, rng, 20.0)


def test_a_tunnel_is_closed_around_the_sensor():
    rng = np.random.default_rng(2)
    poses, _ = moving_drive(tunnel(rng), 3, rng, 20.0)
    points = scan(tunnel(np.random.default_rng(2)), poses[0], EXACT, rng)
    steep = np.abs(points[:, 2]) > np.abs(points[:, :2]).max(axis=1) * 0.2
    assert len(points) > 0.7 * EXACT.rings * EXACT.azimuth_steps
    assert np.linalg.norm(points[steep], axis=1).max() < 30.0


@pytest.fixture(scope='module')
def messages():
    by_topic = {}
    with open_recording(FAST) as recording:
        for topic, _, message in recording.messages(recording.topics):
            by_topic.setdefault(topic, []).append(message)
    return by_topic


def test_the_fast_drive_is_made_again_bit_for_bit(tmp_path, capsys):
    again = tmp_path / 'fast.mcap'
    drive = ['--speed', '15', '--turn-rate', '60', '--scans', '14']
    assert main(['simulate', '--out', str(again), *drive]) == 0
    digest = hashlib.sha256(FAST.read_bytes()).hexdigest()
    assert hashlib.sha256(again.read_bytes()).hexdigest() == digest
    assert digest in (ROOT / 'bags' / 'README.md').read_text()


def test_the_fast_drive_holds_what_its_readme_says(messages):
    assert FAST.stat().st_size <= 5_000_000
    counts = {topic: len(found) for topic, found in messages.items()}
    assert counts == {'/target': 1, '/source': 14, '/initial_guess': 15, '/ground_truth': 15}
    for source, truth in zip(messages['/source'], messages['/ground_truth'], strict=False):
        assert stamp_ns(source) == stamp_ns(truth)
        assert [field.name for field in source.fields] == ['x', 'y', 'z', 'time']
    guess, truth = (
        matrix_of(messages[f'/{name}'][0]) for name in ('initial_guess', 'ground_truth')
    )
    off = se3.inverse(truth) @ guess
    assert np.linalg.norm(guess[:3, 3] - truth[:3, 3]) == pytest.approx(0.3)
    assert np.degrees(se3.rotation_angle(off)) == pytest.approx(1.5)


def test_the_scans_of_the_fast_drive_meet_the_map_once_undone_by_the_truth(messages):
    from scipy.spatial import cKDTree

    tree = cKDTree(read_points(messages['/target'][0]).points)
    poses = [matrix_of(message) for message in messages['/ground_truth']]
    for k in (3, 9):
        source, T = messages['/source'][k], poses[k]
        points = read_points(source).points
        times = np.frombuffer(source.data, np.float32).reshape(-1, 4)[:, 3].astype(float)
        twist = se3.log(se3.inverse(T) @ poses[k + 1])[[3, 4, 5, 0, 1, 2]] / 0.1
        undone = undistort(points, times, twist)
        before, after = (
            np.median(tree.query(se3.transform_points(T, each))[0]) for each in (points, undone)
        )
        assert after < 0.7 * before


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--turn-rate', '30'], 'give --speed, too'),
        (['--sweep', '0.1'], 'give --speed, too'),
        (['--speed', 'nan'], '--speed is nan; it must be from 0 to 100'),
        (['--speed', '10', '--sweep', '0'], '--sweep is 0; it must be from 0.01 to 1'),
        (['--speed', '10', '--turn-rate', '-1'], '--turn-rate is -1'),
        (['--speed', '50'], 'take 105 m; the route is'),
    ],
)
def test_a_drive_that_cannot_be_is_refused_in_one_line(capsys, tmp_path, arguments, message):
    out = tmp_path / 'drive.mcap'
    assert main(['simulate', '--out', str(out), *arguments]) != 0
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1
    assert not out.exists()


@pytest.mark.parametrize('scene', ['room', 'forest', 'tunnel'])
def test_a_drive_through_each_scene_is_recorded(tmp_path, capsys, scene):
    out = tmp_path / f'{scene}.mcap'
    drive = ['--scene', scene, '--speed', '1', '--scans', '2']
    assert main(['simulate', '--out', str(out), *drive]) == 0
    with open_recording(out) as recording:
        assert sum(topic == '/source' for topic, _, _ in recording.messages(recording.topics)) == 2
