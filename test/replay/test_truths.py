import numpy as np
from clouds import motion

from idem_ros.recording.messages import transform_message
from idem_ros.replay.truths import Truths


def test_a_truth_is_of_its_stamp_and_of_its_frames(rng):
    truths, pose = Truths(), motion(rng, 10.0, 1.0)
    truths.add(transform_message(pose, 5, 'map', 'lidar'))
    np.testing.assert_allclose(truths.at(5, 'map', 'lidar'), pose, atol=1e-12)
    np.testing.assert_allclose(truths.at(5, '', ''), pose, atol=1e-12)
    assert truths.at(6, 'map', 'lidar') is None
    assert truths.notes == []


def test_of_one_stamp_the_last_counts(rng):
    truths, poses = Truths(), [motion(rng, 10.0, 1.0) for _ in range(3)]
    for stamp, pose in zip((7, 5, 7), poses, strict=True):
        truths.add(transform_message(pose, stamp, 'map', 'lidar'))
    np.testing.assert_allclose(truths.at(7, 'map', 'lidar'), poses[2], atol=1e-12)
    truths.add(transform_message(poses[0], 7, 'map', 'lidar'))
    np.testing.assert_allclose(truths.at(7, 'map', 'lidar'), poses[0], atol=1e-12)
    assert truths.trajectory('lidar').stamps.tolist() == [5, 7]


def test_they_say_whether_all_that_are_waited_for_came():
    truths = Truths()
    for stamp in (2, 3):
        truths.add(transform_message(np.eye(4), stamp, 'map', 'lidar'))
        assert not truths.came_for([4, 2])
    truths.add(transform_message(np.eye(4), 4, 'map', 'lidar'))
    assert truths.came_for([4, 2])


def test_why_one_is_not_believed_is_noted_once(rng):
    truths = Truths()
    wrong = transform_message(np.eye(4), 2, 'map', 'lidar')
    wrong.transform.rotation = type(wrong.transform.rotation)(0.0, 0.0, 0.0, 0.0)
    truths.add(wrong)
    for stamp in (3, 4):
        truths.add(transform_message(np.eye(4), stamp, 'map', 'lidar'))
    assert truths.at(2, 'map', 'lidar') is None
    assert {truths.at(stamp, 'odom', 'lidar') is None for stamp in (3, 4)} == {True}
    assert [note.split(':')[0] for note in truths.notes[:1]] == ['truth']
    assert len(truths.notes) == 2
    assert "the truth has frame_id 'map'" in truths.notes[1]


def test_those_of_a_frame_are_a_trajectory_in_the_order_of_time(rng):
    truths, poses = Truths(), [motion(rng, 10.0, 1.0) for _ in range(4)]
    for stamp, frame, pose in zip((9, 2, 7, 4), ('a', 'a', 'b', 'a'), poses, strict=True):
        truths.add(transform_message(pose, stamp, 'map', frame))
    trajectory = truths.trajectory('a')
    assert trajectory.stamps.tolist() == [2, 4, 9]
    np.testing.assert_allclose(trajectory.poses, [poses[1], poses[3], poses[0]], atol=1e-12)
    assert Truths().trajectory('a') is None


def test_however_many_are_none_and_of_whatever_frames_the_notes_are_few():
    truths = Truths()
    for stamp in range(100):
        wrong = transform_message(np.eye(4), stamp, f'map {stamp // 2}', 'lidar')
        if stamp % 2:
            wrong.transform.translation.x, wrong.transform.translation.y = (
                float('nan'),
                float(stamp),
            )
        truths.add(wrong)
        assert truths.at(stamp, f'map {stamp // 2}' if stamp % 2 else 'odom', 'lidar') is None
    assert len(truths.notes) == 10
    assert sum('not finite' in note for note in truths.notes) == 1
