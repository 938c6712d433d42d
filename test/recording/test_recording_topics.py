from types import SimpleNamespace as Record

import pytest

from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.pairing.guesses import POSE
from idem_ros.recording.reader import Topic
from idem_ros.recording.topics import TopicNotFound, Topics, find_topic, find_topics

IMU = 'sensor_msgs/msg/Imu'
TF = 'tf2_msgs/msg/TFMessage'


def recording(**msgtypes):
    """A recording with topics; '__' in a name stands for '/'."""
    topics = {name.replace('__', '/'): Topic(kind, 1) for name, kind in msgtypes.items()}
    return Record(path='run.mcap', topics=topics)


def test_the_conventional_names_are_found():
    names = {'__target': CLOUD, '__source': CLOUD}
    names |= {'__initial_guess': TRANSFORM, '__ground_truth': TRANSFORM, '__imu': IMU}
    assert find_topics(recording(**names)) == Topics(
        '/target', '/source', '/initial_guess', '/ground_truth'
    )


def test_conventional_names_are_found_under_a_namespace_and_among_others():
    names = {'__idem_node__target': CLOUD, '__idem_node__source': CLOUD, '__camera': CLOUD}
    found = find_topics(recording(**names))
    assert found == Topics('/idem_node/target', '/idem_node/source', None, None)


def test_with_one_cloud_topic_given_the_only_other_one_is_the_other():
    two = recording(__map=CLOUD, __scan=CLOUD, __imu=IMU)
    assert find_topics(two, target='/map').source == '/scan'
    assert find_topics(two, source='/map').target == '/scan'


def test_the_only_transform_is_the_guess():
    names = {'__target': CLOUD, '__source': CLOUD, '__odometry': TRANSFORM}
    found = find_topics(recording(**names))
    assert (found.guess, found.truth) == ('/odometry', None)


def test_the_only_transform_is_not_the_guess_if_it_is_named_truth():
    names = {'__target': CLOUD, '__source': CLOUD, '__ground_truth': TRANSFORM}
    found = find_topics(recording(**names))
    assert (found.guess, found.truth) == (None, '/ground_truth')


def test_what_is_given_needs_no_leading_slash_and_gives_the_name_in_the_recording():
    found = find_topics(
        recording(cloud_1=CLOUD, __cloud_3=CLOUD, cloud_2=CLOUD), 'cloud_3', '/cloud_1'
    )
    assert (found.target, found.source) == ('/cloud_3', 'cloud_1')


def test_poses_to_start_from_are_found_by_name_or_given():
    clouds = {'__target': CLOUD, '__source': CLOUD}
    both = recording(**clouds, __robot__initialpose=POSE, __amcl_pose=POSE)
    assert find_topics(both, guess_type='initial_pose').initial_pose == '/robot/initialpose'
    assert find_topics(both, guess_type='last').initial_pose == '/robot/initialpose'
    assert find_topics(both).initial_pose is None
    given = find_topics(both, guess='amcl_pose', guess_type='initial_pose')
    assert (given.initial_pose, given.guess) == ('/amcl_pose', None)
    with pytest.raises(TopicNotFound, match='no topics named initialpose .*/amcl_pose; choose'):
        find_topics(recording(**clouds, __amcl_pose=POSE), guess_type='initial_pose')


def test_an_open_choice_lists_the_candidates_and_the_option():
    with pytest.raises(TopicNotFound) as refused:
        find_topics(recording(__a=CLOUD, __b=CLOUD, __c=CLOUD))
    assert '/a, /b, /c' in str(refused.value)
    assert '--target-topic' in str(refused.value)


def test_an_open_choice_of_transforms_is_refused_too():
    names = {'__target': CLOUD, '__source': CLOUD, '__a': TRANSFORM, '__b': TRANSFORM}
    with pytest.raises(TopicNotFound, match=r'/a, /b; choose one with --guess-topic'):
        find_topics(recording(**names))


def test_one_cloud_topic_is_not_both_target_and_source():
    with pytest.raises(TopicNotFound, match='no PointCloud2 topic left for the source'):
        find_topics(recording(__scan=CLOUD, __imu=IMU))


def test_a_recording_without_clouds_lists_what_it_has():
    with pytest.raises(TopicNotFound, match=rf'/imu \({IMU}\)'):
        find_topics(recording(__imu=IMU))


def test_a_name_that_is_not_there_is_refused_with_the_candidates():
    with pytest.raises(TopicNotFound, match=r"no topic '/lidar'.*: /scan, /target"):
        find_topics(recording(__scan=CLOUD, __target=CLOUD, __imu=IMU), source='/lidar')


def test_a_topic_of_another_type_is_refused():
    with pytest.raises(TopicNotFound, match=rf'/imu is of type {IMU}; the source must be {CLOUD}'):
        find_topics(recording(__scan=CLOUD, __imu=IMU), source='/imu')


def test_a_single_role_can_be_found():
    assert find_topic(recording(__scan=CLOUD), CLOUD, 'source') == '/scan'
    assert find_topic(recording(__scan=CLOUD), CLOUD, 'source', given='scan') == '/scan'


def tf_of(*names, **options):
    clouds = {'/target': CLOUD, '/source': CLOUD, **dict.fromkeys(names, TF)}
    found = find_topics(
        Record(path='run.mcap', topics={n: Topic(k, 1) for n, k in clouds.items()}),
        guess_type='tf',
        **options,
    )
    return found.tf, found.tf_static


def test_tf_is_taken_where_it_is_there_whoever_else_has_one():
    robots = '/tf', '/tf_static', '/robot2/tf', '/robot2/tf_static'
    assert tf_of(*robots) == (('/tf',), ('/tf_static',))
    assert tf_of('/robot2/tf', '/robot2/tf_static') == (('/robot2/tf',), ('/robot2/tf_static',))
    assert tf_of('/robot2/tf', '/tf_static') == (('/robot2/tf',), ('/tf_static',))


def test_of_several_topics_of_transforms_one_or_more_are_chosen_by_name():
    robots = '/a/tf', '/a/tf_static', '/b/tf', '/tf_static'
    assert tf_of(*robots, tf=['a/tf']) == (('/a/tf',), ('/a/tf_static',))
    assert tf_of(*robots, tf=['/b/tf']) == (('/b/tf',), ('/tf_static',))
    assert tf_of(*robots, tf=['/a/tf', '/b/tf'])[0] == ('/a/tf', '/b/tf')
    with pytest.raises(
        TopicNotFound, match=r'/a/tf, /b/tf; choose one or several with --tf-topic'
    ):
        tf_of(*robots)
    with pytest.raises(TopicNotFound, match=r"no topic '/c/tf'"):
        tf_of(*robots, tf=['/c/tf'])
    with pytest.raises(TopicNotFound, match='with --initial-guess-type tf'):
        find_topics(recording(__target=CLOUD, __source=CLOUD, __tf=TF), tf=['/tf'])
