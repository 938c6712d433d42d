import numpy as np
import pytest
from poses import SECOND, odometry, shifted, tf, transform

from idem_ros.pairing.guesses import MOST, GuessConfig, Trail, UncoveredSweep
from idem_ros.pairing.streamed_guesses import StreamedGuesses
from idem_ros.pairing.transform_tree import TransformTree

MS = SECOND // 1000
STAMP = 100 * SECOND


def trail(*offsets):
    stamps = tuple(STAMP + offset * MS for offset in offsets)
    return Trail(stamps, lambda stamp: shifted((stamp - STAMP) / 1e9))


def test_the_poses_before_and_after_an_interval_are_the_first_and_last():
    stamps, poses = trail(-200, -100, -10, 50, 120, 300).poses_over(STAMP, STAMP + 100 * MS)
    assert [(each - STAMP) // MS for each in stamps.tolist()] == [-10, 50, 120]
    np.testing.assert_allclose(poses[:, 0, 3], [-0.01, 0.05, 0.12])


@pytest.mark.parametrize(
    ('offsets', 'expected'),
    [((-100, 0), [-100, 0]), ((200, 300), [200, 300]), ((0, 100), [0, 100])],
)
def test_two_poses_near_by_suffice(offsets, expected):
    stamps, _ = trail(*offsets).poses_over(STAMP + 50 * MS, STAMP + 100 * MS)
    assert [(each - STAMP) // MS for each in stamps.tolist()] == expected


def test_of_many_poses_some_are_taken_evenly():
    stamps, _ = trail(*range(-50, 200)).poses_over(STAMP, STAMP + 100 * MS)
    assert len(stamps) == MOST
    assert (stamps[0], stamps[-1]) == (STAMP, STAMP + 100 * MS)


@pytest.mark.parametrize(
    ('offsets', 'gap'), [((-300, -200), 'end before the sweep does, by 0.3 s'), ((), '0 poses')]
)
def test_a_gap_is_named(offsets, gap):
    with pytest.raises(UncoveredSweep, match=gap):
        trail(*offsets).poses_over(STAMP, STAMP + 100 * MS)


def test_guesses_of_other_frames_are_no_part_of_a_trail():
    guesses = StreamedGuesses()
    for offset, frame in ((-10, 'map'), (0, 'map'), (5, 'odom'), (10, 'map'), (3000, 'map')):
        guesses.add(odometry(STAMP + offset * MS, shifted(float(offset)), frame, 'lidar'))
    found = guesses.guess_for(STAMP, 'map', 'lidar', GuessConfig()).trail
    assert [(each - STAMP) // MS for each in found.stamps] == [-10, 0, 10]
    assert found.pose_at(STAMP + 10 * MS)[0, 3] == 10.0


def test_a_trail_is_as_it_was_when_the_guess_was_made():
    guesses = StreamedGuesses()
    guesses.add(odometry(STAMP, shifted(1.0), 'map', 'lidar'))
    found = guesses.guess_for(STAMP, 'map', 'lidar', GuessConfig()).trail
    guesses.add(odometry(STAMP, shifted(2.0), 'map', 'lidar'))
    assert found.pose_at(STAMP)[0, 3] == 1.0


@pytest.fixture
def tree():
    """A robot in a map, by odometry at 50 Hz and a correction at 10 Hz; the sensor is fixed."""
    tree = TransformTree()
    tree.add_static(tf(transform(0, shifted(0.5), 'base', 'lidar')))
    for k in range(-5, 6):
        stamp = STAMP + k * 100 * MS
        tree.add(tf(transform(stamp, shifted(10.0), 'map', 'odom')))
    for k in range(-25, 20):
        stamp = STAMP + k * 20 * MS
        tree.add(tf(transform(stamp, shifted((stamp - STAMP) / 1e9), 'odom', 'base')))
    return tree


def test_the_trail_of_tf_is_at_the_stamps_of_all_transforms_on_the_way(tree):
    found = tree.guess_for(STAMP, 'map', 'lidar', GuessConfig(type='tf')).trail
    stamps, poses = found.poses_over(STAMP, STAMP + 100 * MS)
    np.testing.assert_allclose(poses[:, 0, 3], 10.5 + (stamps - STAMP) / 1e9, atol=1e-9)
    assert found.stamps[-1] == STAMP + 380 * MS  # where the first of them ends


def test_frames_that_are_fixed_to_each_other_do_not_move():
    tree = TransformTree()
    tree.add_static(tf(transform(0, shifted(0.5), 'map', 'lidar')))
    found = tree.guess_for(STAMP, 'map', 'lidar', GuessConfig(type='tf')).trail
    _, poses = found.poses_over(STAMP, STAMP + 100 * MS)
    np.testing.assert_array_equal(poses[0], poses[-1])
