"""The truth may be the transform of each source, or a stream of poses of any of ROS's types."""

import numpy as np
import pytest
from clouds import motion, surface
from recordings import START, STEP, scans

from idem_ros.commands.main import main
from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.files.trajectory_file import read_trajectory
from idem_ros.recording.messages import cloud_message, header, transform_message, typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings
from idem_ros.replay.truths import read_truth

TWIST = np.array([0.02, 0.01, 0.05, 0.4, 0.1, 0.0])  # of the sensor, each second


def pose_at(stamp):
    return exp(TWIST * (stamp - START) / 1e9)


def made(kind, **fields):
    return typestore().types[kind](**fields)


def pose(matrix):
    placed = transform_message(matrix, 0, '', '').transform
    at = vars(placed.translation)
    point = {axis: at[axis] for axis in 'xyz'}
    return made(
        'geometry_msgs/msg/Pose',
        position=made('geometry_msgs/msg/Point', **point),
        orientation=placed.rotation,
    )


def stamped(stamp):
    return made(
        'geometry_msgs/msg/PoseStamped', header=header(stamp, 'map'), pose=pose(pose_at(stamp))
    )


def with_covariance(stamp):
    return made(
        'geometry_msgs/msg/PoseWithCovariance', pose=pose(pose_at(stamp)), covariance=np.zeros(36)
    )


def of_poses(stamp):
    return made(
        'geometry_msgs/msg/PoseWithCovarianceStamped',
        header=header(stamp, 'map'),
        pose=with_covariance(stamp),
    )


def odometry(stamp):
    zero = made('geometry_msgs/msg/Vector3', x=0.0, y=0.0, z=0.0)
    twist = made('geometry_msgs/msg/Twist', linear=zero, angular=zero)
    return made(
        'nav_msgs/msg/Odometry',
        header=header(stamp, 'map'),
        child_frame_id='lidar',
        pose=with_covariance(stamp),
        twist=made('geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=np.zeros(36)),
    )


def path(stamp):
    """A path comes again and again, each time with all poses so far."""
    stamps = range(START, stamp + 1, STEP // 4)
    poses = [stamped(each) for each in stamps]
    return made('nav_msgs/msg/Path', header=header(stamp, 'map'), poses=poses)


def transform(stamp):
    return transform_message(pose_at(stamp), stamp, 'map', 'lidar')


TYPES = {
    'PoseStamped': stamped,
    'PoseWithCovarianceStamped': of_poses,
    'Odometry': odometry,
    'Path': path,
}


def drive(rng, truth, offset=0, topic='/ground_truth'):
    """Yield scans of one map, with guesses, and the truth four times as often as scans."""
    points = surface(rng, 600)
    yield '/target', START, cloud_message(points, START, 'map')
    for k in range(4 * 6):
        stamp = START + k * STEP // 4
        yield topic, stamp + 2 + offset, truth(stamp + offset)
        if k % 4 == 0:
            start = motion(rng, 1.0, 0.03) @ pose_at(stamp)
            guess = transform_message(start, stamp, 'map', 'lidar')
            cloud = transform_points(inverse(pose_at(stamp)), points)
            yield '/source', stamp + 3 + offset, cloud_message(cloud, stamp, 'lidar')
            yield '/initial_guess', stamp + 4 + offset, guess


@pytest.fixture
def file(tmp_path):
    return tmp_path / 'x.mcap'


@pytest.mark.parametrize('name', TYPES)
@pytest.mark.parametrize('sequence', [None, 'scan'])
def test_any_pose_on_a_topic_named_so_is_the_truth(file, rng, name, sequence):
    write_mcap(file, drive(rng, TYPES[name]))
    (replayed,) = replay_each(file, [Settings(sequence=sequence)])
    errors = [frame.error_after() for frame in replayed.frames]
    assert len(errors) == 6 - bool(sequence)
    assert max(each.translation_m for each in errors) < 0.01


@pytest.mark.parametrize('name', sorted({*TYPES} - {'Path'}))
def test_a_stream_is_the_truth_of_what_is_between_its_poses(file, rng, name):
    write_mcap(file, drive(rng, TYPES[name], offset=STEP // 10))
    (replayed,) = replay_each(file, [Settings()])
    errors = [frame.error_after() for frame in replayed.frames]
    assert errors[0] is None  # it begins later
    assert max(each.translation_m for each in errors[1:]) < 0.01
    assert any('stream of poses' in note for note in replayed.notes)


def test_a_stream_with_a_gap_is_not_guessed_within_it(file, rng):
    messages = list(drive(rng, odometry, offset=STEP // 10))
    span = range(START + 2 * STEP, START + 4 * STEP)
    write_mcap(file, [each for each in messages if 'truth' not in each[0] or each[1] not in span])
    (replayed,) = replay_each(file, [Settings()])
    known = [frame.error_after() is not None for frame in replayed.frames]
    assert known == [False, True, False, False, False, True]


def test_transforms_are_of_the_sources_of_their_stamps_only(file, rng):
    write_mcap(file, drive(rng, transform, offset=STEP // 10))
    (replayed,) = replay_each(file, [Settings()])
    assert all(frame.error_after() is None for frame in replayed.frames)
    assert 'the truth has no pose of the stamp of any source' in replayed.notes


def test_odometry_of_another_frame_is_not_believed(file, rng):
    def of_the_base(stamp):
        message = odometry(stamp)
        message.child_frame_id = 'base_link'
        return message

    write_mcap(file, drive(rng, of_the_base))
    (replayed,) = replay_each(file, [Settings()])
    assert all(frame.error_after() is None for frame in replayed.frames)
    assert any("child_frame_id 'base_link'" in note for note in replayed.notes)


def test_a_topic_that_is_named_otherwise_is_taken_by_its_name_only(file, rng, capsys):
    write_mcap(file, drive(rng, odometry, topic='/odom'))
    for words, is_true in (([], False), (['--truth-topic', 'odom'], True)):
        assert main(['replay', str(file), *words]) == 0
        assert ('translation error' in capsys.readouterr().out) == is_true
    assert main(['replay', str(file), '--truth-topic', 'source']) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert 'the ground_truth must be geometry_msgs/msg/TransformStamped or ' in line


@pytest.mark.parametrize('name', TYPES)
def test_a_command_writes_any_of_them_as_a_trajectory(file, rng, name, tmp_path):
    write_mcap(file, drive(rng, TYPES[name]))
    assert main(['truth', str(file), '--out', str(tmp_path / 'x.tum')]) == 0
    found = read_trajectory(tmp_path / 'x.tum')
    expected = [pose_at(stamp) for stamp in found.stamps.tolist()]
    assert len(found) == 24
    np.testing.assert_allclose(found.poses, expected, atol=1e-6)


def test_places_of_sensors_are_transforms(file, rng, tmp_path, capsys):
    write_mcap(file, drive(rng, stamped))
    assert main(['truth', str(file), '--out', str(tmp_path / 'x.yaml')]) == 1
    assert 'places of sensors are geometry_msgs/msg/TransformStamped' in capsys.readouterr().err
    assert not (tmp_path / 'x.yaml').exists()


def test_of_transforms_and_poses_named_so_the_transforms_are_the_truth(file, rng):
    messages = [*scans(rng), ('/odom/ground_truth', START + 5, odometry(START + 5))]
    write_mcap(file, messages)
    with open_recording(file) as recording:
        trajectory, _ = read_truth(recording)
    assert len(trajectory) == 3
