"""Whatever a folder holds, `idem evaluate` evaluates what can be read and names the rest."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from recordings import START, STEP, scans, write_rosbag1, write_sqlite3
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from idem_ros.commands.main import main
from idem_ros.evaluation import one_recording, worker_processes
from idem_ros.recording.messages import header, typestore
from idem_ros.recording.writer import write_mcap

CUSTOM = 'my_robot_msgs/msg/Battery'
CUSTOM_DEFINITION = 'float64 volts\nmy_robot_msgs/Cell[] cells\n' + '=' * 80
CUSTOM_DEFINITION += '\nMSG: my_robot_msgs/Cell\nuint8 number\n'


def messages(n=6, points=400):
    return list(scans(np.random.default_rng(0), n=n, points=points))


def cut(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])


def cut_off_mcap(folder):
    write_mcap(folder / 'x.mcap', messages(points=20_000))
    cut(folder / 'x.mcap', 0.7)


def cut_off_before_its_first_chunk_ends(folder):
    write_mcap(folder / 'x.mcap', messages())
    cut(folder / 'x.mcap', 0.1)


def cut_off_ros1_bag(folder):
    write_rosbag1(folder / 'x.bag', messages(), chunk=10_000)
    cut(folder / 'x.bag', 0.7)


def cut_off_db3(folder):
    write_sqlite3(folder / 'x', messages())
    cut(folder / 'x' / 'x.db3', 0.7)


def empty_file(folder):
    (folder / 'x.mcap').touch()


def empty_ros1_file(folder):
    (folder / 'x.bag').touch()


def recording_of_nothing(folder):
    write_mcap(folder / 'x.mcap', [])


def no_recording_at_all(folder):
    (folder / 'x.mcap').write_text('this is a letter to my grandmother')


def raw_mcap(path, logged, **options):
    """Write messages of any types of a typestore."""
    store = options.pop('store', typestore())
    with path.open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE, **options)
        writer.start(profile='ros2')
        channels = {}
        for topic, log_time, message in logged:
            kind = message.__msgtype__
            if topic not in channels:
                definition, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, 'ros2msg', definition.encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            raw = bytes(store.serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, raw, log_time)
        writer.finish()


def mcap_without_index(folder):
    raw_mcap(
        folder / 'x.mcap',
        messages(),
        index_types=IndexType.NONE,
        repeat_channels=False,
        repeat_schemas=False,
        use_statistics=False,
        use_summary_offsets=False,
    )


def ros1_bag_without_index(folder):
    write_rosbag1(folder / 'x.bag', messages())
    content = (folder / 'x.bag').read_bytes()
    at = content.index(b'index_pos=') + 10
    (folder / 'x.bag').write_bytes(content[:at] + bytes(8) + content[at + 8 :])


def ros1_bag(folder):
    write_rosbag1(folder / 'x.bag', messages())


def humble(folder):
    """A db3 of ROS 2 Humble: no definitions of types in it."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(folder / 'x', version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for topic, log_time, message in messages():
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], log_time, typestore().serialize_cdr(message, kind))


def with_types_of_its_own(folder):
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(CUSTOM_DEFINITION, CUSTOM))
    cell = store.types['my_robot_msgs/msg/Cell']
    battery = store.types[CUSTOM](volts=12.0, cells=[cell(number=1)])
    raw_mcap(folder / 'x.mcap', [('/battery', START - 1, battery), *messages()], store=store)


def damaged_chunk(folder):
    write_mcap(folder / 'x.mcap', messages(points=20_000))
    content = bytearray((folder / 'x.mcap').read_bytes())
    content[len(content) // 2] ^= 1
    (folder / 'x.mcap').write_bytes(content)


def without_clouds(folder):
    kept = [logged for logged in messages() if 'guess' in logged[0]]
    write_mcap(folder / 'x.mcap', kept)


def never_pairing(folder):
    """Guesses an hour before the sources."""

    def earlier(message):
        return replace(message, header=header(1, message.header.frame_id))

    logged = [
        (topic, log_time, earlier(message) if 'guess' in topic else message)
        for topic, log_time, message in messages()
    ]
    write_mcap(folder / 'x.mcap', logged)


def truth_of_a_part(folder):
    kept = [
        logged for logged in messages() if 'truth' not in logged[0] or logged[1] < START + 3 * STEP
    ]
    write_mcap(folder / 'x.mcap', kept)


def without_truth(folder):
    kept = [logged for logged in messages() if 'truth' not in logged[0]]
    write_mcap(folder / 'x.mcap', kept)


def folder_without_metadata(folder):
    (folder / 'x').mkdir()
    logged = messages()
    write_mcap(folder / 'x' / 'x_0.mcap', logged[:10])
    write_mcap(folder / 'x' / 'x_1.mcap', logged[10:])


def rosbag2_folder_of_metadata_alone(folder):
    write_sqlite3(folder / 'x', messages())
    (folder / 'x' / 'x.db3').unlink()


READ = {
    cut_off_mcap: (range(2, 6), 'cut off or damaged'),
    cut_off_ros1_bag: (range(3, 6), 'cut off or damaged'),
    mcap_without_index: ([6], ''),
    ros1_bag_without_index: ([6], 'not indexed'),
    ros1_bag: ([6], ''),
    humble: ([6], ''),
    with_types_of_its_own: ([6], ''),
    damaged_chunk: (range(4, 6), 'chunks left out: 1'),
    truth_of_a_part: ([6], ''),
    without_truth: ([6], ''),
    folder_without_metadata: ([6], ''),
}
NOT_READ = {
    cut_off_before_its_first_chunk_ends: 'bytes make a message',
    cut_off_db3: 'malformed',
    empty_file: 'empty',
    empty_ros1_file: 'empty',
    recording_of_nothing: 'no PointCloud2 topic',
    no_recording_at_all: 'magic',
    without_clouds: 'no PointCloud2 topic',
    never_pairing: '6 sources wait for',
    rosbag2_folder_of_metadata_alone: 'holds no recording',
}


@pytest.fixture
def good(tmp_path, monkeypatch):
    """A folder with one good recording, which must be evaluated whatever lies beside it."""

    def in_this_process(tasks, jobs, watch):
        yield from enumerate(one_recording.evaluated(task) for task in tasks)

    monkeypatch.setattr(worker_processes, 'in_processes', in_this_process)  # to save time
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'bags').mkdir()
    write_mcap(tmp_path / 'bags' / 'good.mcap', messages(n=2))
    return tmp_path / 'bags'


def evaluated(*argv):
    code = main(['evaluate', 'bags', '--jobs', '1', '--out', 'out', *argv])
    summary = json.loads(Path('out/summary.json').read_text())
    return code, {Path(entry['bag']).stem: entry for entry in summary['recordings']}, summary


@pytest.mark.parametrize('write', READ, ids=lambda write: write.__name__)
def test_what_can_be_read_is_evaluated(good, capsys, write):
    frames, note = READ[write]
    write(good)
    code, entries, summary = evaluated()
    assert code == 0
    assert entries['good']['frames'] == 2
    assert entries['x']['frames'] in frames
    assert summary['pooled']['frames'] == 2 + entries['x']['frames']
    notes = ' '.join(entries['x']['notes'])
    assert note in notes
    assert bool(note) == bool(notes)
    assert notes in capsys.readouterr().out


@pytest.mark.parametrize('write', NOT_READ, ids=lambda write: write.__name__)
def test_what_cannot_be_evaluated_is_named_and_counted_and_the_rest_goes_on(good, capsys, write):
    write(good)
    code, entries, summary = evaluated()
    assert code == 1
    assert entries['good']['frames'] == 2
    assert NOT_READ[write] in entries['x']['reason']
    assert 'bags/x' in entries['x']['reason']
    assert '\n' not in entries['x']['reason']
    assert (summary['evaluated'], summary['failed']) == (1, 1)
    assert entries['x']['reason'] in capsys.readouterr().out
    assert len(list(Path('out').glob('good.*.json'))) == len(list(Path('out').glob('*.*.json')))


@pytest.mark.parametrize(('write', 'known'), [(truth_of_a_part, 2), (without_truth, 0)])
def test_frames_without_truth_are_counted(good, write, known):
    write(good)
    _, entries, summary = evaluated()
    assert (entries['x']['with_truth'], summary['pooled']['with_truth']) == (known, 2 + known)
    assert (entries['x']['translation_error_m']['median'] is None) == (known == 0)


def test_recordings_without_the_named_topics_are_named_with_the_topics_they_have(good):
    logged = [('/lidar' if topic == '/source' else topic, *rest) for topic, *rest in messages()]
    write_mcap(good / 'x.mcap', logged)
    code, entries, _ = evaluated('--source-topic', '/lidar', '--target-topic', 'target')
    assert code == 1
    assert entries['x']['frames'] == 6
    assert "no topic '/lidar'" in entries['good']['reason']
    assert '/source' in entries['good']['reason']


def test_nothing_is_lost_of_a_recording_that_is_evaluated(good):
    before = {path: path.read_bytes() for path in good.rglob('*') if path.is_file()}
    evaluated()
    assert {path: path.read_bytes() for path in good.rglob('*') if path.is_file()} == before
