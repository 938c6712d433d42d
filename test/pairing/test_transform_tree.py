import numpy as np
import pytest
from clouds import motion
from poses import SECOND, shifted, tf, transform

from idem_ros.core import InvalidTransform
from idem_ros.core.geometry.se3 import inverse
from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.stamped_poses import DoubtfulGuess
from idem_ros.pairing.transform_tree import TransformTree

CONFIG = GuessConfig()


@pytest.fixture
def tree():
    return TransformTree()


def pose_of(tree, stamp, target='map', source='lidar', config=CONFIG):
    return tree.guess_for(stamp, target, source, config).T_target_source


def moving(tree, *stamps_and_x, frame='map', child='lidar'):
    for stamp, x in stamps_and_x:
        tree.add(tf(transform(stamp, x, frame, child)))


def test_one_transform_at_its_own_stamp_is_taken_bit_for_bit(tree, rng):
    message = transform(5, motion(rng, 30.0, 2.0), 'map', 'lidar')
    tree.add(tf(message))
    np.testing.assert_array_equal(pose_of(tree, 5), matrix_of(message))
    guess = tree.guess_for(5, 'map', 'lidar', CONFIG)
    assert (guess.target_frame, guess.source_frame) == ('map', 'lidar')


def test_a_chain_of_static_and_moving_transforms_is_multiplied(tree, rng):
    map_odom, odom_base, base_lidar = (motion(rng, 40.0, 3.0) for _ in range(3))
    tree.add_static(tf(transform(0, base_lidar, 'base', 'lidar')))
    tree.add(tf(transform(7, map_odom, 'map', 'odom'), transform(7, odom_base, 'odom', 'base')))
    np.testing.assert_allclose(pose_of(tree, 7), map_odom @ odom_base @ base_lidar, atol=1e-12)


def test_a_way_that_goes_up_and_down_again_is_found(tree, rng):
    base_lidar, base_camera = motion(rng, 40.0, 3.0), motion(rng, 40.0, 3.0)
    tree.add_static(
        tf(transform(0, base_lidar, 'base', 'lidar'), transform(0, base_camera, 'base', 'camera'))
    )
    pose = pose_of(tree, 123, target='camera')
    np.testing.assert_allclose(pose, inverse(base_camera) @ base_lidar, atol=1e-12)
    pose = pose_of(tree, 123, target='lidar', source='base')
    np.testing.assert_allclose(pose, inverse(base_lidar), atol=1e-12)


def test_each_moving_transform_is_interpolated_to_the_stamp(tree):
    moving(tree, (100, 0.0), (200, 1.0), frame='map', child='odom')
    moving(tree, (110, 5.0), (190, 9.0), frame='odom', child='lidar')
    np.testing.assert_allclose(pose_of(tree, 150), shifted(0.5 + 7.0), atol=1e-12)


def test_the_frame_of_both_clouds_is_where_it_is(tree):
    np.testing.assert_array_equal(pose_of(tree, 1, 'lidar', '/lidar'), np.eye(4))


def test_names_may_begin_with_a_slash(tree):
    tree.add_static(tf(transform(0, 2.0, '/map', 'lidar')))
    np.testing.assert_array_equal(pose_of(tree, 9, 'map', '/lidar'), shifted(2.0))


def test_frames_that_are_not_connected_are_named_and_never_taken_for_equal(tree):
    with pytest.raises(
        NotYet, match="'lidar'.*'map' .tf knows no 'lidar' and no 'map'"
    ) as missing:
        pose_of(tree, 1)
    assert missing.value.is_doubtful
    moving(tree, (1, 0.0), frame='map', child='odom')
    moving(tree, (1, 0.0), frame='base', child='lidar')
    with pytest.raises(NotYet, match="source frame 'lidar' with the target frame 'map'$"):
        pose_of(tree, 1)


def test_a_transform_that_has_not_come_yet_is_waited_for_by_name(tree):
    tree.add_static(tf(transform(0, 1.0, 'base', 'lidar')))
    moving(tree, (SECOND, 0.0), frame='map', child='base')
    with pytest.raises(NotYet, match="'base' in 'map': the newest is 0.5 s older") as missing:
        pose_of(tree, 3 * SECOND // 2)
    assert not missing.value.is_doubtful


def test_a_transform_too_old_or_unusable_is_refused_by_name(tree):
    moving(tree, (SECOND, 0.0), (9 * SECOND, 1.0))
    with pytest.raises(DoubtfulGuess, match="'lidar' in 'map': .*max_age"):
        pose_of(tree, 5 * SECOND)
    bad = transform(5 * SECOND, 0.0, 'map', 'lidar')
    bad.transform.translation.x = float('nan')
    tree.add(tf(bad))
    with pytest.raises(InvalidTransform, match="'lidar' in 'map': .*not finite"):
        pose_of(tree, 5 * SECOND)
    with pytest.raises(InvalidTransform, match="'lidar' in /tf_static: .*not finite"):
        tree.add_static(tf(bad))


@pytest.mark.parametrize(
    ('target', 'source', 'role'), [('', 'lidar', 'target'), ('map', '', 'source')]
)
def test_a_cloud_without_a_frame_is_refused(tree, target, source, role):
    with pytest.raises(DoubtfulGuess, match=f'the {role} cloud names no frame'):
        pose_of(tree, 1, target, source)


def test_frames_in_a_circle_are_refused_and_do_not_hang(tree):
    for frame, child in (('a', 'b'), ('b', 'c'), ('c', 'a')):
        tree.add_static(tf(transform(0, 1.0, frame, child)))
    with pytest.raises(DoubtfulGuess, match="circle: 'a' in 'c' in 'b' in 'a'"):
        pose_of(tree, 1, 'map', 'a')


def test_a_frame_given_to_itself_keeps_its_way(tree):
    moving(tree, (1, 1.0), frame='map')
    moving(tree, (2, 2.0), frame='/lidar', child='lidar')
    tree.add_static(tf(transform(0, 3.0, 'lidar', '/lidar')))
    assert pose_of(tree, 1)[0, 3] == 1.0
    assert tree.stamps(tf(transform(5, 0.0, 'lidar', 'lidar'))) == []


def test_a_frame_given_another_parent_forgets_the_one_before(tree):
    moving(tree, (1, 1.0), frame='map')
    moving(tree, (2, 2.0), frame='odom')
    with pytest.raises(NotYet, match='does not connect'):
        pose_of(tree, 1)
    np.testing.assert_array_equal(pose_of(tree, 2, target='odom'), shifted(2.0))


def test_what_is_later_than_a_stamp_can_be_forgotten_but_for_what_is_static(tree):
    tree.add_static(tf(transform(0, 1.0, 'base', 'lidar')))
    moving(tree, (5, 0.0), (9, 0.0), frame='map', child='base')
    tree.forget_after(5)
    np.testing.assert_array_equal(pose_of(tree, 5), shifted(1.0))
    with pytest.raises(NotYet):
        pose_of(tree, 6)


def test_every_frame_of_a_message_has_a_stamp_of_its_own(tree):
    message = tf(transform(5, frame='map', child='/odom'), transform(9, frame='odom', child='b'))
    assert tree.stamps(message) == [(('tf', 'odom'), 5), (('tf', 'b'), 9)]
    assert not tree
    tree.add(message)
    assert tree
