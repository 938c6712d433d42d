import numpy as np
from clouds import motion

from idem_ros.evaluation.truths import Truths
from idem_ros.recording.messages import transform_message


def test_a_truth_is_of_its_stamp_and_of_its_frames(rng):
    truths, pose = Truths(), motion(rng, 10.0, 1.0)
    assert truths.add(transform_message(pose, 5, 'map', 'lidar')) == 5
    np.testing.assert_allclose(truths.at(5, 'map', 'lidar'), pose, atol=1e-12)
    np.testing.assert_allclose(truths.at(5, '', ''), pose, atol=1e-12)
    assert truths.at(6, 'map', 'lidar') is None
    assert truths.notes == []
    assert (5 in truths, 6 in truths) == (True, False)


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
