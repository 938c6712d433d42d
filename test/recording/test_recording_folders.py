"""A rosbag2 folder is read as far as it is there; what its metadata.yaml says else is told."""

import lz4.frame
import pytest
import yaml
from recordings import TOPICS, bare_mcap, mcap_folder, scans
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from idem_ros.commands.main import main
from idem_ros.recording.folder import UnreadableRecording, fingerprint, recordings_in
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay
from idem_ros.results.gate import findings, read_rules
from idem_ros.results.result_file import read_result, record_text
from idem_ros.results.summary import json_record

STORAGES = {'db3': StoragePlugin.SQLITE3, 'mcap': StoragePlugin.MCAP}


def compressed(folder, messages, mode, storage):
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        channels = {}
        for topic, log_time, message in messages:
            kind = message.__msgtype__
            if topic not in channels:
                channels[topic] = writer.add_connection(topic, kind, typestore=typestore())
            writer.write(channels[topic], log_time, typestore().serialize_cdr(message, kind))
    return folder


def read(path):
    with open_recording(path) as recording:
        logged = [each[:2] for each in recording.messages(recording.topics)]
        return recording.topics, logged, recording.warnings, +recording.lost


def split(folder, messages, parts):
    """Write a folder whose metadata.yaml names a file for each part, with the files."""
    mcap_folder(folder.parent, messages).rename(folder)
    (folder / 'scans.mcap').unlink()
    metadata = yaml.safe_load((folder / 'metadata.yaml').read_text())
    information = metadata['rosbag2_bagfile_information']
    names = [f'run_{i}.mcap' for i in range(len(parts))]
    information['relative_file_paths'] = names
    information['files'] = [
        {'path': name, 'message_count': len(part)} for name, part in zip(names, parts, strict=True)
    ]
    (folder / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    for name, part in zip(names, parts, strict=True):
        write_mcap(folder / name, part)
    return folder


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_folders_are_read_and_so_are_their_files_alone(tmp_path, rng, mode, storage):
    messages = list(scans(rng))
    folder = compressed(tmp_path / 'run', messages, mode, STORAGES[storage])
    (file,) = folder.glob('run.*')
    for path in (folder, file):
        topics, logged, warnings, lost = read(path)
        assert (topics, warnings, lost) == (TOPICS, [], {})
        assert logged == [each[:2] for each in messages]
    assert recordings_in(folder.parent) == [folder]
    (folder / 'metadata.yaml').unlink()
    assert read(folder)[1] == logged
    assert fingerprint(folder)['size'] == file.stat().st_size


def test_a_compressed_file_under_another_name_is_known_by_its_bytes(tmp_path, rng):
    messages = list(scans(rng))
    folder = compressed(tmp_path / 'run', messages, CompressionMode.FILE, StoragePlugin.MCAP)
    (folder / 'run.mcap.zstd').rename(tmp_path / 'x.mcap')
    assert len(read(tmp_path / 'x.mcap')[1]) == 10


def test_a_compressed_file_that_is_cut_off_is_named(tmp_path, rng):
    folder = compressed(tmp_path / 'run', scans(rng), CompressionMode.FILE, StoragePlugin.MCAP)
    file = folder / 'run.mcap.zstd'
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(UnreadableRecording, match=r'run\.mcap\.zstd cannot be read'):
        read(folder)


def test_a_file_that_is_missing_is_named_with_its_messages(tmp_path, rng):
    messages = list(scans(rng, n=6))
    folder = split(tmp_path / 'run', messages, [messages[:7], messages[7:13], messages[13:]])
    assert read(folder)[2:] == ([], {})
    (folder / 'run_1.mcap').unlink()
    _, logged, warnings, lost = read(folder)
    assert logged == [each[:2] for each in messages[:7] + messages[13:]]
    (warning,) = warnings
    assert 'run_1.mcap is missing' in warning
    assert '(6 of 19 messages)' in warning
    assert lost == {'files_missing': 1}


def test_a_file_that_metadata_does_not_name_is_read_if_it_is_of_its_kind_and_named(tmp_path, rng):
    messages = list(scans(rng))
    folder = mcap_folder(tmp_path, messages[:7])
    write_mcap(folder / 'scans_1.mcap', messages[7:])
    (folder / 'scans.db3').write_bytes(b'')
    _, logged, warnings, lost = read(folder)
    assert logged == [each[:2] for each in messages]
    assert lost == {'files_extra': 2}
    assert 'scans_1.mcap is not named in metadata.yaml; it is read, too' in warnings[0]
    assert 'scans.db3 is not named in metadata.yaml; it is left out' in warnings[1]


def test_a_file_and_the_same_one_compressed_count_once(tmp_path, rng):
    folder = compressed(tmp_path / 'run', scans(rng), CompressionMode.FILE, StoragePlugin.MCAP)
    bare_mcap(folder, scans(rng)).rename(folder / 'run.mcap')
    _, logged, warnings, _ = read(folder)
    assert (len(logged), warnings) == (10, [])


def test_a_file_that_cannot_be_read_is_named_and_counted(tmp_path, rng):
    messages = list(scans(rng))
    folder = split(tmp_path / 'run', messages, [messages[:4], messages[4:]])
    (folder / 'run_1.mcap').write_bytes(b'')
    _, logged, (warning,), lost = read(folder)
    assert len(logged) == 4
    assert 'run_1.mcap cannot be read' in warning
    assert lost == {'files_unreadable': 1}


@pytest.mark.parametrize(
    'text',
    ['', '{', 'rosbag2_bagfile_information: 3', '[' * 2000, 'a: &a [x]\nb: {<<: *a}', '\0'],
)
def test_metadata_that_is_none_is_told_and_the_files_are_read(tmp_path, rng, text):
    folder = mcap_folder(tmp_path, scans(rng))
    (folder / 'metadata.yaml').write_text(text)
    _, logged, (warning,), _ = read(folder)
    assert len(logged) == 10
    assert 'metadata.yaml is no' in warning
    assert 'are read by their names' in warning
    assert '\n' not in warning


def test_a_gate_fails_on_what_is_missing_unless_a_rule_allows_it(tmp_path, rng):
    messages = list(scans(rng, n=4))
    folder = split(tmp_path / 'run', messages, [messages[:7], messages[7:]])
    (folder / 'run_1.mcap').unlink()
    file = tmp_path / 'result.json'
    file.write_text(''.join(record_text(json_record(replay(folder)))))
    (tmp_path / 'rules.yaml').write_text('rules: [frames >= 1]')
    assert main(['gate', str(file), '--rules', str(tmp_path / 'rules.yaml')]) == 1
    [[held, unspoken]] = findings(read_rules(tmp_path / 'rules.yaml'), [read_result(file)])
    assert held.holds
    assert (unspoken.rule.text, unspoken.value, unspoken.holds) == ('files_missing == 0', 1, False)
    (tmp_path / 'rules.yaml').write_text('rules: [frames >= 1, files_missing <= 1]')
    assert main(['gate', str(file), '--rules', str(tmp_path / 'rules.yaml')]) == 0


@pytest.mark.parametrize('name', ['lab.mcap', 'lab.db3', 'scans_0.bag'])
def test_a_file_that_was_renamed_is_read_as_what_it_holds_and_named(tmp_path, rng, name):
    folder = mcap_folder(tmp_path, scans(rng))
    (folder / 'scans.mcap').rename(folder / name)
    topics, logged, warnings, lost = read(folder)
    assert (topics, len(logged)) == (TOPICS, 10)
    assert f'{folder / "scans.mcap"} is missing' in warnings[0]
    assert f'{folder / name} is not named in metadata.yaml; it is read, too' in warnings[1]
    assert lost == {'files_missing': 1, 'files_extra': 1}


@pytest.mark.parametrize('paths', [[], 'scans.mcap', None, {}])
def test_metadata_that_names_no_file_hides_none(tmp_path, rng, paths):
    folder = mcap_folder(tmp_path, scans(rng))
    metadata = yaml.safe_load((folder / 'metadata.yaml').read_text())
    metadata['rosbag2_bagfile_information']['relative_file_paths'] = paths
    (folder / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    topics, logged, warnings, _ = read(folder)
    assert (topics, len(logged), len(warnings)) == (TOPICS, 10, 1)
    assert 'metadata.yaml' in warnings[0]


def test_of_several_recordings_that_metadata_does_not_name_none_is_taken(tmp_path, rng):
    folder = mcap_folder(tmp_path, scans(rng))
    for name in ('monday', 'tuesday'):
        write_mcap(folder / f'{name}.mcap', scans(rng, n=1))
    (folder / 'scans.mcap').unlink()
    with pytest.raises(UnreadableRecording, match='holds several recordings'):
        read(folder)


def test_a_folder_that_lost_its_files_says_so(tmp_path, rng):
    folder = mcap_folder(tmp_path, scans(rng))
    (folder / 'scans.mcap').unlink()
    with pytest.raises(UnreadableRecording, match='the files that it names are elsewhere'):
        read(folder)


def test_an_empty_file_beside_a_whole_one_is_named_once(tmp_path, rng):
    folder = mcap_folder(tmp_path, scans(rng))
    (folder / 'scans_1.mcap').touch()
    _, logged, (warning,), lost = read(folder)
    assert len(logged) == 10
    assert 'scans_1.mcap cannot be read: it is empty' in warning
    assert lost == {'files_unreadable': 1, 'files_extra': 1}


@pytest.mark.parametrize('suffix', ['.mcap.lz4', '.mcap'])
def test_what_is_compressed_by_lz4_is_read_as_far_as_it_goes(tmp_path, rng, suffix):
    messages = list(scans(rng, n=8, points=30_000))
    content = lz4.frame.compress(bare_mcap(tmp_path, messages).read_bytes())
    path = tmp_path / f'x{suffix}'
    path.write_bytes(content)
    assert read(path)[1] == [each[:2] for each in messages]
    path.write_bytes(content[: len(content) // 2])
    _, logged, (warning,), _ = read(path)
    assert 0 < len(logged) < len(messages)
    assert 'its end is missing' in warning
    path.write_bytes(content[:20] + bytes(200) + content[220:])
    with pytest.raises(UnreadableRecording, match='its compression by lz4 is damaged'):
        read(path)
