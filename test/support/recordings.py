"""Small recordings that several tests use, and the same one in every format."""

import numpy as np
from clouds import motion, surface
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.recording.messages import cloud_message, transform_message, typestore
from idem_ros.recording.reader import Topic
from idem_ros.recording.writer import write_mcap

START, STEP = 10**9, 10**8
FRAMES = 'map', 'lidar'
TOPICS = {  # of three scans
    '/ground_truth': Topic(TRANSFORM, 3),
    '/initial_guess': Topic(TRANSFORM, 3),
    '/source': Topic(CLOUD, 3),
    '/target': Topic(CLOUD, 1),
}


def scans(rng, n=3, points=400, perturbation=(2.0, 0.05)):
    """Yield (topic, log time, message): one target, then each source, guess and truth."""
    target_frame, source_frame = FRAMES
    target = surface(rng, points)
    yield '/target', START, cloud_message(target, START, target_frame)
    for i in range(n):
        stamp = START + (i + 1) * STEP
        truth = motion(rng, 20.0, 0.5)
        source = transform_points(inverse(truth), surface(rng, points))
        guess = motion(rng, *perturbation) @ truth
        poses = {'/initial_guess': guess, '/ground_truth': truth}
        yield '/source', stamp, cloud_message(source, stamp, source_frame)
        for k, (topic, pose) in enumerate(poses.items(), start=1):
            yield topic, stamp + k, transform_message(pose, stamp, target_frame, source_frame)


def write_rosbag2(folder, messages, storage):
    """Write a rosbag2 folder (metadata.yaml beside one file)."""
    with Writer2(folder, version=9, storage_plugin=storage) as writer:
        connections = {}
        for topic, log_time, message in messages:
            msgtype = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, msgtype, typestore=typestore())
            raw = typestore().serialize_cdr(message, msgtype)
            writer.write(connections[topic], log_time, raw)


def write_sqlite3(folder, messages):
    write_rosbag2(folder, messages, StoragePlugin.SQLITE3)


def write_rosbag1(path, messages, compression=None, chunk=2**20):
    """Write a ROS 1 bag: the same messages, whose headers get a sequence number."""
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer1(path)
    writer.chunk_threshold = chunk
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for topic, log_time, message in messages:
            msgtype = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, msgtype, typestore=store)
            raw = store.serialize_ros1(_as_ros1(message, store), msgtype)
            writer.write(connections[topic], log_time, raw)


def _as_ros1(message, store):
    old = message.header
    header = store.types['std_msgs/msg/Header'](seq=0, stamp=old.stamp, frame_id=old.frame_id)
    fields = {**vars(message), 'header': header}
    fields.pop('__msgtype__', None)
    return store.types[message.__msgtype__](**fields)


def transforms_of(replayed):
    return np.array([frame.refinement.result.T_target_source for frame in replayed.frames])


def bare_mcap(folder, messages):
    write_mcap(folder / 'scans.mcap', messages)
    return folder / 'scans.mcap'


def mcap_folder(folder, messages):
    write_rosbag2(folder / 'scans', messages, StoragePlugin.MCAP)
    return folder / 'scans'


def ros1_bag(folder, messages):
    write_rosbag1(folder / 'scans.bag', messages)
    return folder / 'scans.bag'


def four_bags(folder):
    """Write a.mcap to d.mcap of two scans each; return their paths."""
    paths = [folder / f'{name}.mcap' for name in 'abcd']
    for seed, path in enumerate(paths):
        write_mcap(path, scans(np.random.default_rng(seed), n=2))
    return [str(path) for path in paths]
