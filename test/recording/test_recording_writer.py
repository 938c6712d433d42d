import io
import os
import tracemalloc

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from recordings import scans
from rosbags.highlevel import AnyReader

from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.embedded import Embedded, UnreadableMcap, read_embedded
from idem_ros.recording.messages import cloud_message, diagnostics_message, header, typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import PIECE, write_mcap

BARE = 'repeat_channels', 'repeat_schemas', 'use_statistics', 'use_summary_offsets'


@pytest.fixture
def written(tmp_path, rng):
    path = tmp_path / 'scans.mcap'
    write_mcap(path, scans(rng))
    return path


def test_the_same_messages_give_the_same_bytes(written, tmp_path):
    again = tmp_path / 'again.mcap'
    write_mcap(again, scans(np.random.default_rng(0)))
    assert again.read_bytes() == written.read_bytes()


def test_the_bytes_name_neither_library_version_nor_machine(written):
    with written.open('rb') as stream:
        header = make_reader(stream).get_header()
    assert (header.profile, header.library) == ('ros2', 'idem_ros')


def test_channels_are_described_as_rosbag2_and_foxglove_read_them(written):
    with written.open('rb') as stream:
        summary = make_reader(stream, validate_crcs=True).get_summary()
    assert {schema.encoding for schema in summary.schemas.values()} == {'ros2msg'}
    for channel in summary.channels.values():
        assert channel.message_encoding == 'cdr'
        assert channel.metadata['topic_type_hash'].startswith('RIHS01_')
    assert summary.statistics.message_count == 10


def test_the_embedded_definitions_have_the_hashes_of_jazzy(written):
    with AnyReader([written]) as reader:  # parses every definition and its quality of service
        for connection in reader.connections:
            embedded = reader.typestore.hash_rihs01(connection.msgtype)
            assert embedded == typestore().hash_rihs01(connection.msgtype)
            (qos,) = connection.ext.offered_qos_profiles
            assert (qos.reliability.name, qos.durability.name) == ('RELIABLE', 'VOLATILE')


def test_what_is_embedded_comes_back_and_leaves_the_messages_alone(written, tmp_path):
    metadata = {'made': {'by': 'a test', 'with': '\u00e9'}, 'empty': {}}
    contents = {'a.json': b'{}', 'b.bin': bytes(range(256)) * 10_000}
    attachments = {name: ('text/x', io.BytesIO(content)) for name, content in contents.items()}
    path = tmp_path / 'embedded.mcap'
    write_mcap(path, scans(np.random.default_rng(0)), metadata, attachments)
    assert read_embedded(path) == Embedded(metadata, contents)
    assert read_embedded(written) == Embedded({}, {})
    with open_recording(path) as one, open_recording(written) as other:
        assert one.topics == other.topics
        times = [[time for _, time, _ in r.messages(r.topics)] for r in (one, other)]
    assert times[0] == times[1]


def test_a_large_attachment_goes_in_pieces_and_comes_back_whole(tmp_path, rng):
    contents = {'empty': b'', 'r\u00e9sultat': rng.bytes(2 * PIECE + 1), 'small': b'x'}
    attachments = {name: ('text/x', io.BytesIO(content)) for name, content in contents.items()}
    write_mcap(tmp_path / 'large.mcap', [], attachments=attachments)
    with (tmp_path / 'large.mcap').open('rb') as stream:
        names = [each.name for each in make_reader(stream).iter_attachments()]
    assert names == ['empty', 'r\u00e9sultat', 'r\u00e9sultat.2', 'r\u00e9sultat.3', 'small']
    assert read_embedded(tmp_path / 'large.mcap').attachments == contents


def test_an_mcap_cut_off_does_not_give_half_of_what_is_embedded(tmp_path):
    path = tmp_path / 'cut.mcap'
    write_mcap(path, scans(np.random.default_rng(0)), {'made': {'by': 'a test'}})
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(UnreadableMcap, match=r'cut.mcap is cut off or damaged'):
        read_embedded(path)
    with pytest.raises(UnreadableMcap, match=r'none.mcap cannot be read'):
        read_embedded(tmp_path / 'none.mcap')


def test_of_an_mcap_without_an_index_no_chunk_is_inflated_for_what_is_embedded(tmp_path):
    path = tmp_path / 'bare.mcap'
    with path.open('wb') as stream:
        bare = {name: False for name in BARE}
        some = Writer(stream, index_types=IndexType.NONE, **bare)
        some.start()
        some.add_metadata('made', {'by': 'a test'})
        channel = some.register_channel('/x', 'json', 0)
        some.add_message(channel, 0, bytes(10**8), 0)
        some.finish()
    tracemalloc.start()
    with pytest.raises(UnreadableMcap, match='it has no index'):
        read_embedded(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10**6


def test_a_message_that_fails_leaves_the_old_recording(written):
    before = written.read_bytes()

    def failing():
        yield from scans(np.random.default_rng(1))
        raise RuntimeError('no more scans')

    with pytest.raises(RuntimeError, match='no more scans'):
        write_mcap(written, failing())
    assert written.read_bytes() == before
    assert list(written.parent.iterdir()) == [written]


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(UnwritableFile, match='nowhere does not exist'):
        write_mcap(tmp_path / 'nowhere' / 'x.mcap', [])


@pytest.mark.parametrize('dtype', [np.float32, np.float64])
def test_a_cloud_message_holds_its_points(rng, dtype):
    points = rng.normal(size=(20, 3)).astype(dtype)
    message = cloud_message(points, 5, 'lidar', dtype)
    raw = typestore().serialize_cdr(message, message.__msgtype__)
    again = typestore().deserialize_cdr(raw, message.__msgtype__)
    np.testing.assert_array_equal(read_points(again).points, points)


def test_a_header_keeps_every_nanosecond():
    stamp = header(1_700_000_000_123_456_789, 'map').stamp
    assert (stamp.sec, stamp.nanosec) == (1_700_000_000, 123_456_789)


def test_a_header_holds_the_last_second_of_a_stamp_beyond_time():
    stamp = header(2**31 * 10**9 + 5, 'map').stamp
    assert (stamp.sec, stamp.nanosec) == (2**31 - 1, 999_999_999)
    message = header(2**62, 'map')
    assert typestore().serialize_cdr(message, 'std_msgs/msg/Header')


def test_diagnostics_survive_serialisation():
    message = diagnostics_message('/idem', 'task', 1, 'no_overlap', {'q_tot': '0.5'}, 7)
    raw = typestore().serialize_cdr(message, message.__msgtype__)
    (status,) = typestore().deserialize_cdr(raw, message.__msgtype__).status
    assert (status.name, status.level, status.message) == ('/idem: task', 1, 'no_overlap')
    assert [(value.key, value.value) for value in status.values] == [('q_tot', '0.5')]


def test_nobody_waits_for_what_a_pipe_may_carry(tmp_path):
    os.mkfifo(tmp_path / 'pipe.mcap')
    with pytest.raises(UnreadableMcap, match='is a pipe'):
        read_embedded(tmp_path / 'pipe.mcap')
