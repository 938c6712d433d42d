import shutil
import sqlite3
import tarfile
from contextlib import closing

import numpy as np
import pytest
from mcap.writer import Writer
from recordings import (
    TOPICS,
    bare_mcap,
    mcap_folder,
    ros1_bag,
    scans,
    write_sqlite3,
)

from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import Topic, UnreadableRecording, open_recording
from idem_ros.recording.writer import write_mcap


def sqlite3_folder(folder, messages):
    write_sqlite3(folder / 'scans', messages)
    return folder / 'scans'


def bare_db3(folder, messages):
    (file,) = sqlite3_folder(folder, messages).glob('*.db3')
    return file


def folder_without_metadata(folder, messages):
    (folder / 'scans').mkdir()
    write_mcap(folder / 'scans' / 'scans_0.mcap', messages)
    return folder / 'scans'


@pytest.mark.parametrize(
    'write',
    [bare_mcap, mcap_folder, sqlite3_folder, bare_db3, folder_without_metadata, ros1_bag],
)
def test_every_format_gives_the_same_topics_and_messages(tmp_path, rng, write):
    expected = list(scans(rng))
    with open_recording(write(tmp_path, expected)) as recording:
        read = list(recording.messages(recording.topics))
    assert recording.topics == TOPICS
    assert recording.warnings == []
    assert [logged[:2] for logged in read] == [logged[:2] for logged in expected]
    for (topic, _, message), (_, _, original) in zip(read, expected, strict=True):
        assert message.header.stamp.nanosec == original.header.stamp.nanosec
        if TOPICS[topic].msgtype == CLOUD:
            np.testing.assert_array_equal(message.data, original.data)
        else:
            assert message.transform.rotation.w == original.transform.rotation.w


def test_only_the_topics_asked_for_are_read(tmp_path, rng):
    with open_recording(bare_mcap(tmp_path, scans(rng))) as recording:
        assert {topic for topic, _, _ in recording.messages(['/source'])} == {'/source'}
        assert list(recording.messages([])) == []
        assert list(recording.messages(['/nowhere'])) == []


def test_a_split_recording_without_metadata_is_read_in_log_order(tmp_path, rng):
    messages = list(scans(rng))
    write_mcap(tmp_path / 'b_0.mcap', messages[1::2])
    write_mcap(tmp_path / 'b_1.mcap', messages[::2])
    with open_recording(tmp_path) as recording:
        times = [log_time for _, log_time, _ in recording.messages(recording.topics)]
    assert recording.topics == TOPICS
    assert times == [log_time for _, log_time, _ in messages]


@pytest.mark.parametrize(
    ('name', 'content', 'reason'),
    [
        ('nothing.mcap', b'', 'empty'),
        ('garbage.mcap', b'this is no recording at all, yet long enough', 'magic'),
        ('garbage.db3', b'this is no recording at all, yet long enough', 'file is not a database'),
        ('nothing.db3', b'', 'cannot be read: it is empty'),
        ('garbage.bag', b'this is no recording at all, yet long enough', 'cannot be read'),
        ('nothing.bag', b'', 'cannot be read'),
        ('start.mcap', b'\x89MCAP0\r\n', 'none of its 8 bytes make a message'),
        ('start.bag', b'#ROSBAG V2.0\n', 'none of its 13 bytes make a message'),
        ('scan.zip', b'PK', 'suffix must be .mcap, .db3, .bag'),
        ('0.bin', bytes(48), 'make one: idem bag TARGET SOURCE --out run.mcap'),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line_with_its_name(
    tmp_path, name, content, reason
):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(UnreadableRecording) as refused, open_recording(path):
        pass
    assert str(refused.value).count(str(path)) == 1
    assert reason in str(refused.value)
    assert '.,' not in str(refused.value)
    assert '\n' not in str(refused.value)


def test_of_a_folder_with_one_file_that_cannot_be_read_the_others_are(tmp_path, rng):
    messages = list(scans(rng))
    write_mcap(tmp_path / 'b_0.mcap', messages)
    (tmp_path / 'b_1.mcap').write_bytes(b'')
    with open_recording(tmp_path) as recording:
        assert len(list(recording.messages(recording.topics))) == 10
    (warning,) = recording.warnings
    assert 'b_1.mcap' in warning
    (tmp_path / 'b_0.mcap').write_bytes(b'')
    with pytest.raises(UnreadableRecording, match=r'b_0\.mcap'), open_recording(tmp_path):
        pass


def test_a_message_that_cannot_be_decoded_is_left_out_with_a_warning(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    messages = list(scans(rng))
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start(profile='ros2')
        definition, _ = typestore().generate_msgdef(TRANSFORM, ros_version=2)
        schema = writer.register_schema(TRANSFORM, 'ros2msg', definition.encode())
        channel = writer.register_channel('/guess', 'cdr', schema)
        whole = bytes(typestore().serialize_cdr(messages[2][2], TRANSFORM))
        for i, raw in enumerate((whole, whole[:20], whole)):
            writer.add_message(channel, i, raw, i)
        writer.finish()
    with open_recording(path) as recording:
        assert [logged[1] for logged in recording.messages(['/guess'])] == [0, 2]
    assert '2 of 3 messages' in recording.warnings[0]
    assert +recording.lost == {'messages_left_out': 1}


def test_a_missing_path_and_an_empty_folder_are_refused(tmp_path):
    with pytest.raises(UnreadableRecording, match='does not exist'):
        open_recording(tmp_path / 'nowhere').__enter__()
    with pytest.raises(UnreadableRecording, match='holds no recording'):
        open_recording(tmp_path).__enter__()


@pytest.mark.parametrize('name', ['0.PLY', 'velodyne/000000.bin'])
def test_a_folder_of_clouds_is_told_how_to_become_a_recording(tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_bytes(bytes(48))
    with pytest.raises(UnreadableRecording, match='idem bag FOLDER --out run.mcap'):
        open_recording(tmp_path).__enter__()


def test_an_empty_recording_has_no_topics(tmp_path):
    write_mcap(tmp_path / 'empty.mcap', [])
    with open_recording(tmp_path / 'empty.mcap') as recording:
        assert recording.topics == {}
        assert list(recording.messages([])) == []


def test_reads_the_recording_of_a_depth_camera(shared_data, tmp_path):
    archive = shared_data / 'bags/point_cloud_transport_tutorial'
    (packed,) = archive.glob('*.tar.xz')
    with tarfile.open(packed) as tar:
        tar.extractall(tmp_path, filter='data')
    (metadata,) = tmp_path.rglob('metadata.yaml')
    with open_recording(metadata.parent) as recording:
        assert recording.topics['/point_cloud'] == Topic(CLOUD, 263)
        _, _, first = next(recording.messages(['/point_cloud']))
    assert first.point_step == 16
    assert len(read_points(first).points) == first.width
    shutil.rmtree(metadata.parent)


def test_reads_a_dirty_recording_of_a_truck(shared_data):
    with open_recording(shared_data / 'bags/truck_icp_test/default_conf.mcap_0.mcap') as recording:
        (_, _, message), *_ = recording.messages(['cloud_1'])
    read = read_points(message)
    assert read.dropped_zero == 60_192
    assert len(read.points) == 20_064


@pytest.mark.parametrize('column', ['name', 'type', 'serialization_format'])
@pytest.mark.parametrize('value', [None, 3])
def test_a_topic_without_a_name_a_type_or_a_format_is_refused(tmp_path, rng, column, value):
    write_sqlite3(tmp_path / 'x', scans(rng))
    (file,) = (tmp_path / 'x').glob('*.db3')
    with closing(sqlite3.connect(file)) as database, database:
        (sql,) = database.execute("SELECT sql FROM sqlite_master WHERE name = 'topics'").fetchone()
        rows = database.execute('SELECT * FROM topics').fetchall()
        database.execute('DROP TABLE topics')
        database.execute(sql.replace(' NOT NULL', '').replace(' TEXT', ''))
        database.executemany(f'INSERT INTO topics VALUES ({",".join("?" * len(rows[0]))})', rows)
        database.execute(f'UPDATE topics SET {column} = ? WHERE id = 1', (value,))
    with (
        pytest.raises(UnreadableRecording, match='a topic has no name, no type or no format'),
        open_recording(file),
    ):
        pass
