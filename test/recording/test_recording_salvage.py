"""Recordings that are cut off or damaged: what is left of them is read, the rest is told."""

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from recordings import (
    TOPICS,
    bare_mcap,
    mcap_folder,
    ros1_bag,
    scans,
    write_rosbag1,
)
from rosbags.rosbag1 import Writer as Writer1

from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap


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


def test_metadata_of_another_recording_is_told_and_what_is_there_is_read(tmp_path, rng):
    messages = list(scans(rng))
    folder = mcap_folder(tmp_path, messages)
    (file,) = folder.glob('*.mcap')
    bare_mcap(tmp_path, messages[:7]).replace(file)  # of other QoS, too
    with open_recording(folder) as recording:
        assert len(list(recording.messages(recording.topics))) == 7
    (warning,) = recording.warnings
    assert 'metadata.yaml tells of 10 messages, its files hold 7' in warning


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


def test_a_folder_with_metadata_whose_mcap_is_cut_off_is_salvaged(tmp_path, rng):
    folder = mcap_folder(tmp_path, scans(rng))
    (file,) = folder.glob('*.mcap')
    content = file.read_bytes()
    file.write_bytes(content[:-40])
    with open_recording(folder) as recording:
        assert recording.topics == TOPICS
        assert len(list(recording.messages(recording.topics))) == 10
    assert len(recording.warnings) == 1
