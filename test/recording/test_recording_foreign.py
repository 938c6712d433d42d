"""Channels nobody asked for cannot hurt; what is asked for is read by the standard's types."""

import sqlite3
import struct
from contextlib import closing

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from recordings import TOPICS, scans, write_sqlite3
from rosbags.typesys import Stores, get_typestore

from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.decoding import UnreadableTopic
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import Topic, open_recording
from idem_ros.recording.topics import find_topics

INDEXED = {}
UNINDEXED = {
    'index_types': IndexType.NONE,
    'use_statistics': False,
    'repeat_channels': False,
    'repeat_schemas': False,
    'use_summary_offsets': False,
}


def definition(msgtype, store=None):
    version = 1 if store else 2
    text, _ = (store or typestore()).generate_msgdef(msgtype, ros_version=version)
    return text


def written(path, logged, *, foreign=(), change=lambda msgtype, text: text, **options):
    """Write messages as MCAP, after channels of others.

    Args:
        foreign: [(topic, encoding, schema name, form, definition)], each with a message.
        change: takes a type and its definition, returns the one to be recorded.
    """
    options = {'chunk_size': 20_000, 'compression': CompressionType.NONE, **options}
    with path.open('wb') as stream:
        writer = Writer(stream, **options)
        writer.start(profile='')
        for i, (topic, encoding, *schema, text) in enumerate(foreign):
            id_ = writer.register_schema(*schema, text.encode())
            channel = writer.register_channel(topic, encoding, id_)
            writer.add_message(channel, 10**9 + i, b'\x00\x01\x00\x00{}', 0)
        channels = {}
        for topic, log_time, message in logged:
            kind = message.__msgtype__
            if topic not in channels:
                text = change(kind, definition(kind))
                id_ = writer.register_schema(kind, 'ros2msg', text.encode())
                channels[topic] = writer.register_channel(topic, 'cdr', id_)
            raw = bytes(typestore().serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, raw, log_time)
        writer.finish()
    return path


FOREIGN = {
    'json': ('/log', 'json', 'foxglove.Log', 'jsonschema', '{"type": "object"}'),
    'protobuf': ('/grid', 'protobuf', 'foxglove.Grid', 'protobuf', '\x0a\x00'),
    'a matrix': ('/vendor', 'cdr', 'vendor/msg/X', 'ros2msg', 'uint8[4,4] matrix\n'),
    'a constant': ('/v', 'cdr', 'v/msg/X', 'ros2idl', 'const long A = (((((((((1)))))))));'),
    'an array': ('/v', 'cdr', 'v/msg/X', 'ros2msg', 'string[1000000] x\n'),
    'no text': ('/v', 'cdr', 'v/msg/X', 'ros2idl', '\x00'),
    'a Header of its own': ('/v', 'cdr', 'std_msgs/msg/Header', 'ros2msg', 'string wrong\n'),
    'a cloud in JSON': ('/source2', 'json', CLOUD, 'jsonschema', '{}'),
    'the same topic': ('/source', 'json', CLOUD, 'jsonschema', '{}'),
}


@pytest.mark.parametrize('options', [INDEXED, UNINDEXED], ids=['indexed', 'not indexed'])
@pytest.mark.parametrize('name', FOREIGN)
def test_a_foreign_channel_changes_nothing_and_log_order_is_kept(tmp_path, rng, name, options):
    messages = list(scans(rng, n=6))
    blocks = [*messages[:1], *messages[10:], *messages[1:10]]  # not in log order in the file
    path = written(tmp_path / 'x.mcap', blocks, foreign=[FOREIGN[name]], **options)
    with open_recording(path) as recording:
        find_topics(recording)
        logged = [each[:2] for each in recording.messages(list(TOPICS))]
    assert logged == [each[:2] for each in messages]
    assert recording.warnings == []


def test_a_topic_of_another_encoding_says_so(tmp_path, rng):
    path = written(tmp_path / 'x.mcap', scans(rng), foreign=[FOREIGN['json']])
    with open_recording(path) as recording:
        assert recording.topics['/log'] == Topic('foxglove.Log (json)', 1)
        with pytest.raises(UnreadableTopic, match=r'x\.mcap: /log is of type foxglove\.Log'):
            next(recording.messages(['/log']))


def test_messages_of_ros_1_in_an_mcap_are_read(tmp_path, rng):
    noetic = get_typestore(Stores.ROS1_NOETIC)
    header = noetic.types['std_msgs/msg/Header']
    (_, _, message), *_ = scans(rng)
    stamped = header(seq=7, stamp=message.header.stamp, frame_id='map')
    cloud = noetic.types[CLOUD](**{**_fields(message), 'header': stamped})
    with (tmp_path / 'x.mcap').open('wb') as stream:
        writer = Writer(stream)
        writer.start(profile='ros1')
        text = definition(CLOUD, noetic)
        schema = writer.register_schema('sensor_msgs/PointCloud2', 'ros1msg', text.encode())
        channel = writer.register_channel('/scan', 'ros1', schema)
        writer.add_message(channel, 5, bytes(noetic.serialize_ros1(cloud, CLOUD)), 5)
        writer.finish()
    with open_recording(tmp_path / 'x.mcap') as recording:
        assert recording.topics == {'/scan': Topic(CLOUD, 1)}
        ((_, _, read),) = recording.messages(['/scan'])
    np.testing.assert_array_equal(read_points(read).points, read_points(message).points)


def _fields(message):
    return {k: v for k, v in vars(message).items() if k != '__msgtype__'}


ALIKE = {
    'comments and constants': lambda text: '# a word\nuint8 A=3\n' + text,
    'a type of the same size': lambda text: text.replace('bool is_dense', 'uint8 is_dense'),
    'a bound': lambda text: text.replace('uint8[] data', 'uint8[<=9000000] data'),
    'what it uses left out': lambda text: text.split('=' * 80)[0],
    'no definition': lambda text: '',
}
OTHERWISE = {
    'a string': ('uint32 height', 'string height', 'height is string instead of uint32'),
    'wider': ('uint32 width', 'uint64 width', 'width is int64 instead of uint32'),
    'swapped': (
        'uint32 height\nuint32 width',
        'uint32 width\nuint32 height',
        'width stands',
    ),
    'one more': ('bool is_dense', 'bool is_dense\nstring[1000000] x', 'it adds x'),
    'one less': ('bool is_dense\n', '', 'it lacks is_dense'),
    'nested': ('builtin_interfaces/Time stamp', 'uint32 seq', 'header.seq stands where'),
    'fixed': ('uint8[] data', 'uint8[8] data', 'data is int8[8] instead of a sequence'),
    'nonsense': ('uint32 height', 'uint32[4,4] height', 'has the line'),
    'itself': ('std_msgs/Header header', 'PointCloud2 header', 'header.header stands where'),
}


@pytest.mark.parametrize('name', ALIKE)
def test_a_definition_that_is_the_same_on_the_wire_is_read(tmp_path, rng, name):
    def change(msgtype, text):
        return ALIKE[name](text) if msgtype == CLOUD else text

    path = written(tmp_path / 'x.mcap', scans(rng), change=change)
    with open_recording(path) as recording:
        assert len(list(recording.messages(TOPICS))) == 10


@pytest.mark.parametrize('name', OTHERWISE)
def test_a_definition_that_differs_on_the_wire_is_refused_in_one_line(tmp_path, rng, name):
    old, new, reason = OTHERWISE[name]

    def change(msgtype, text):
        changed = '\n'.join(line.split('#')[0].rstrip() for line in text.splitlines() if line)
        assert old in changed or msgtype != CLOUD
        return changed.replace(old, new) if msgtype == CLOUD else text

    path = written(tmp_path / 'x.mcap', scans(rng), change=change)
    with open_recording(path) as recording:
        assert len(list(recording.messages(['/initial_guess']))) == 3
        with pytest.raises(UnreadableTopic) as refused:
            next(recording.messages(['/source', '/initial_guess']))
    assert reason in str(refused.value)
    assert f'another {CLOUD} than that of ROS 2 Jazzy' in str(refused.value)
    assert '\n' not in str(refused.value)


def test_two_definitions_of_one_nested_type_concern_each_its_own(tmp_path, rng):
    def change(msgtype, text):
        if msgtype != TRANSFORM:
            return text
        return text.replace('MSG: std_msgs/Header\n', 'MSG: std_msgs/Header\nuint32 seq\n')

    path = written(tmp_path / 'x.mcap', scans(rng), change=change)
    with open_recording(path) as recording:
        assert len(list(recording.messages(['/source', '/target']))) == 4
        with pytest.raises(UnreadableTopic, match=r'header\.seq stands where header\.stamp'):
            recording.require_readable('/initial_guess')


def test_foreign_topics_and_definitions_of_a_db3_change_nothing(tmp_path, rng):
    messages = list(scans(rng))
    write_sqlite3(tmp_path / 'x', messages)
    with closing(sqlite3.connect(tmp_path / 'x/x.db3')) as database, database:
        foreign = ('/log', 'foxglove.Log', 'json', '', '')
        database.execute('INSERT INTO topics VALUES (99, ?, ?, ?, ?, ?)', foreign)
        database.execute("INSERT INTO messages VALUES (999, 99, 5, '{}')")
        strange = ('foxglove.Log', 'protobuf', b'\xff\x00', '')
        database.execute('INSERT INTO message_definitions VALUES (99, ?, ?, ?, ?)', strange)
    with open_recording(tmp_path / 'x/x.db3') as recording:
        assert recording.topics['/log'] == Topic('foxglove.Log (json)', 1)
        logged = [each[:2] for each in recording.messages(list(TOPICS))]
    assert logged == [each[:2] for each in messages]
    assert recording.warnings == []


def test_messages_that_stand_beside_the_chunks_of_an_indexed_file_are_read(tmp_path, rng):
    path, messages, channels = tmp_path / 'x.mcap', list(scans(rng, n=6)), {}
    with path.open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start(profile='')
        for k, (topic, log_time, message) in enumerate(messages):
            kind = message.__msgtype__
            if topic not in channels:
                id_ = writer.register_schema(kind, 'ros2msg', definition(kind).encode())
                channels[topic] = writer.register_channel(topic, 'cdr', id_)
            if k == 10:
                writer.flush()
                writer._Writer__chunk_builder = None  # the format lets a writer change its mind
            raw = bytes(typestore().serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, raw, log_time)
        writer.finish()
    with open_recording(path) as recording:
        logged = [each[:2] for each in recording.messages(recording.topics)]
        assert logged == [each[:2] for each in messages]
        assert (recording.warnings, +recording.lost) == ([], {})


def test_a_chunk_that_is_of_another_time_than_its_index_tells_is_left_out(tmp_path, rng):
    messages = list(scans(rng, n=6))
    path = written(tmp_path / 'x.mcap', messages, enable_crcs=False, chunk_size=5_000)
    content = bytearray(path.read_bytes())
    last = messages[-1][1]
    at = content.rindex(struct.pack('<B', 0x08), 0, content.rindex(struct.pack('<Q', last)))
    begin = at + 9  # opcode and length, then the earliest log time
    content[begin : begin + 8] = struct.pack('<Q', last)
    path.write_bytes(content)
    with open_recording(path) as recording:
        times = [each[1] for each in recording.messages(recording.topics)]
        assert times == sorted(times)
        assert 0 < len(times) < len(messages)
        assert 'of before the time that its index tells' in recording.warnings[0]
        assert recording.lost['chunks_left_out'] == 1


def test_types_of_idl_may_be_parted_by_colons(tmp_path, rng):
    path = tmp_path / 'x.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start(profile='')
        channels = {}
        for topic, log_time, message in scans(rng):
            kind = message.__msgtype__
            if topic not in channels:
                id_ = writer.register_schema(kind.replace('/', '::'), 'omgidl', b'')
                channels[topic] = writer.register_channel(topic, 'cdr', id_)
            raw = bytes(typestore().serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, raw, log_time)
        writer.finish()
    with open_recording(path) as recording:
        assert recording.topics == TOPICS
        assert len(list(recording.messages(recording.topics))) == 10
