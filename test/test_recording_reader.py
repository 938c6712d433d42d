import shutil
import tarfile

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from recordings import scans, write_rosbag1, write_rosbag2, write_sqlite3
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin

from idem_ros.pointcloud2 import read_points
from idem_ros.recording.messages import CLOUD, TRANSFORM, typestore
from idem_ros.recording.reader import Topic, UnreadableRecording, open_recording
from idem_ros.recording.writer import write_mcap

TOPICS = {
    '/ground_truth': Topic(TRANSFORM, 3),
    '/initial_guess': Topic(TRANSFORM, 3),
    '/source': Topic(CLOUD, 3),
    '/target': Topic(CLOUD, 1),
}


def bare_mcap(folder, messages):
    write_mcap(folder / 'scans.mcap', messages)
    return folder / 'scans.mcap'


def mcap_folder(folder, messages):
    write_rosbag2(folder / 'scans', messages, StoragePlugin.MCAP)
    return folder / 'scans'


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


def ros1_bag(folder, messages):
    write_rosbag1(folder / 'scans.bag', messages)
    return folder / 'scans.bag'


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


@pytest.fixture
def long_recording(tmp_path, rng):
    """A recording of a chunk per scan."""
    path = tmp_path / 'long.mcap'
    write_mcap(path, scans(rng, n=8, points=30_000))
    return path


@pytest.mark.parametrize('kept', [0.5, 0.9, 0.9999])
def test_of_a_cut_off_mcap_the_beginning_is_read_with_a_warning_that_says_how_much(
    long_recording, kept
):
    with open_recording(long_recording) as recording:
        whole = list(recording.messages(recording.topics))
    content = long_recording.read_bytes()
    size = int(kept * len(content))
    long_recording.write_bytes(content[:size])
    with open_recording(long_recording) as recording:
        read = list(recording.messages(recording.topics))
        (warning,) = recording.warnings
    assert [logged[:2] for logged in read] == [logged[:2] for logged in whole[: len(read)]]
    assert len(read) == sum(topic.count for topic in recording.topics.values())
    assert len(read) >= kept * len(whole) - 5  # one scan, and the target alone
    np.testing.assert_array_equal(read_points(read[1][2]).points, read_points(whole[1][2]).points)
    assert f'{len(read)} messages' in warning
    assert f'of its {size} bytes' in warning


def test_a_damaged_chunk_of_a_cut_off_mcap_is_not_believed(long_recording):
    content = bytearray(long_recording.read_bytes()[:-100])
    middle = len(content) // 2
    content[middle : middle + 8] = bytes(8)
    long_recording.write_bytes(content)
    with open_recording(long_recording) as recording:
        assert 20 <= len(list(recording.messages(recording.topics))) < 25
    assert 'cut off or damaged' in recording.warnings[0]
    assert 'chunks left out: 1' in recording.warnings[0]


def test_messages_outside_of_chunks_are_salvaged_one_by_one(tmp_path, rng):
    path = tmp_path / 'unchunked.mcap'
    messages = list(scans(rng))
    with path.open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE, use_chunking=False)
        writer.start(profile='ros2')
        channels = {}
        for topic, log_time, message in messages:
            if topic not in channels:
                definition, _ = typestore().generate_msgdef(message.__msgtype__, ros_version=2)
                schema = writer.register_schema(
                    message.__msgtype__, 'ros2msg', definition.encode()
                )
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            raw = bytes(typestore().serialize_cdr(message, message.__msgtype__))
            writer.add_message(channels[topic], log_time, raw, log_time)
        end_of_messages = stream.tell()
    path.write_bytes(path.read_bytes()[: end_of_messages - 1])  # the last message lacks a byte
    with open_recording(path) as recording:
        read = list(recording.messages(recording.topics))
    assert [logged[:2] for logged in read] == [logged[:2] for logged in messages[:-1]]


def test_a_damaged_chunk_is_left_out_with_a_warning_and_what_follows_is_read(long_recording):
    with open_recording(long_recording) as recording:
        whole = [logged[:2] for logged in recording.messages(recording.topics)]
    content = bytearray(long_recording.read_bytes())
    content[len(content) // 2] ^= 1  # one bit of a point: only the CRC can tell
    long_recording.write_bytes(content)
    with open_recording(long_recording) as recording:
        read = [logged[:2] for logged in recording.messages(recording.topics)]
        (warning,) = recording.warnings
    assert set(read) < set(whole)
    assert read == sorted(read, key=lambda logged: logged[1])
    assert (read[0], read[-1]) == (whole[0], whole[-1])
    assert 20 <= len(read) < len(whole) == 25
    assert f'{len(read)} of 25 messages can be read; chunks left out: 1' in warning
    assert 'checksum' in warning


def test_messages_that_are_promised_and_do_not_come_are_told(tmp_path, rng):
    messages = list(scans(rng))
    folder = mcap_folder(tmp_path, messages)
    (file,) = folder.glob('*.mcap')
    bare_mcap(tmp_path, messages).replace(
        file
    )  # other QoS than in metadata.yaml: rosbags skips it
    with open_recording(folder) as recording:
        assert list(recording.messages(recording.topics)) == []
    (warning,) = recording.warnings
    assert '0 of the 10 messages' in warning


@pytest.mark.parametrize(
    ('name', 'content', 'reason'),
    [
        ('nothing.mcap', b'', 'empty'),
        ('garbage.mcap', b'this is no recording at all, yet long enough', 'magic'),
        ('garbage.db3', b'this is no recording at all, yet long enough', 'cannot be read'),
        ('garbage.bag', b'this is no recording at all, yet long enough', 'cannot be read'),
        ('nothing.bag', b'', 'cannot be read'),
        ('start.mcap', b'\x89MCAP0\r\n', 'none of its 8 bytes make a message'),
        ('start.bag', b'#ROSBAG V2.0\n', 'none of its 13 bytes make a message'),
        ('scan.zip', b'PK', 'suffix must be .mcap, .db3, .bag'),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line_with_its_name(
    tmp_path, name, content, reason
):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(UnreadableRecording) as refused, open_recording(path):
        pass
    assert str(path) in str(refused.value)
    assert reason in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize('compression', [None, *Writer1.CompressionFormat])
@pytest.mark.parametrize('kept', [0.4, 0.999])
def test_of_a_ros1_bag_that_is_cut_off_the_beginning_is_read(tmp_path, rng, compression, kept):
    whole = list(scans(rng, n=6))
    path = tmp_path / 'scans.bag'
    write_rosbag1(path, whole, compression, chunk=10_000)
    content = path.read_bytes()
    size = int(kept * len(content))
    path.write_bytes(content[:size])
    with open_recording(path) as recording:
        read = list(recording.messages(recording.topics))
        (warning,) = recording.warnings
    assert [logged[:2] for logged in read] == [logged[:2] for logged in whole[: len(read)]]
    assert len(read) >= kept * len(whole) - 7  # a chunk, and the index
    assert len(read) == sum(topic.count for topic in recording.topics.values())
    np.testing.assert_array_equal(read_points(read[1][2]).points, read_points(whole[1][2]).points)
    assert f'{len(read)} messages can be read' in warning
    assert f'of its {size} bytes' in warning


def test_a_ros1_bag_whose_recorder_crashed_has_no_index_and_is_read(tmp_path, rng):
    path = ros1_bag(tmp_path, scans(rng))
    content = path.read_bytes()
    key = b'index_pos='
    at = content.index(key) + len(key)
    path.write_bytes(content[:at] + bytes(8) + content[at + 8 :])
    with open_recording(path) as recording:
        assert recording.topics == TOPICS
        assert len(list(recording.messages(recording.topics))) == 10
    assert 'not indexed' in recording.warnings[0]


def test_a_damaged_chunk_of_a_ros1_bag_is_left_out(tmp_path, rng):
    path = tmp_path / 'scans.bag'
    write_rosbag1(path, scans(rng, n=6), Writer1.CompressionFormat.BZ2, chunk=10_000)
    content = bytearray(path.read_bytes())
    at = content.index(b'BZh', len(content) // 2) + 20
    content[at : at + 50] = bytes(50)
    path.write_bytes(content)
    with open_recording(path) as recording:
        read = [logged[1] for logged in recording.messages(recording.topics)]
        (warning,) = recording.warnings
    assert read == sorted(read)
    assert 12 <= len(read) < 19
    assert f'{len(read)} of 19 messages can be read; chunks left out: 1' in warning


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


def test_a_message_that_cannot_be_decoded_ends_the_recording_with_a_warning(tmp_path, rng):
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
        assert [logged[1] for logged in recording.messages(['/guess'])] == [0]
    assert '1 of 3 messages' in recording.warnings[0]


def test_a_missing_path_and_an_empty_folder_are_refused(tmp_path):
    with pytest.raises(UnreadableRecording, match='does not exist'):
        open_recording(tmp_path / 'nowhere').__enter__()
    with pytest.raises(UnreadableRecording, match='holds no recording'):
        open_recording(tmp_path).__enter__()


def test_an_empty_recording_has_no_topics(tmp_path):
    write_mcap(tmp_path / 'empty.mcap', [])
    with open_recording(tmp_path / 'empty.mcap') as recording:
        assert recording.topics == {}
        assert list(recording.messages([])) == []


def test_a_folder_with_metadata_whose_mcap_is_cut_off_is_salvaged(tmp_path, rng):
    folder = mcap_folder(tmp_path, scans(rng))
    (file,) = folder.glob('*.mcap')
    content = file.read_bytes()
    file.write_bytes(content[:-40])
    with open_recording(folder) as recording:
        assert recording.topics == TOPICS
        assert len(list(recording.messages(recording.topics))) == 10
    assert len(recording.warnings) == 1


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
