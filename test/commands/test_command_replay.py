import hashlib
import json
import os
import tempfile

import numpy as np
import pytest
from recordings import scans, write_sqlite3

from idem_ros.commands.main import main
from idem_ros.messages.building import DIAGNOSTICS, TRANSFORM
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.recording.embedded import read_embedded
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.reader import Topic, open_recording
from idem_ros.recording.writer import write_mcap


@pytest.fixture
def folder(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mcap('scans.mcap', scans(rng))
    return tmp_path


def test_prints_a_table_with_errors_before_and_after(folder, capsys):
    assert main(['replay', 'scans.mcap']) == 0
    captured = capsys.readouterr()
    assert captured.err == ''  # no progress bar where there is no terminal
    rows = {line[:24].strip(): line[24:].split() for line in captured.out.splitlines()}
    before, _, after, _ = map(float, rows['rotation error [deg]'])
    assert before == pytest.approx(2.0)
    assert after < before
    assert float(rows['q_tot [nat]'][2]) < float(rows['q_tot [nat]'][0])
    assert '3 registered (3 converged)' in captured.out


def test_json_to_stdout_is_nothing_but_json(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', '-']) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)['summary']['frames'] == 3
    assert '3 registered' in captured.err


def test_every_output_holds_the_same_transforms(folder, capsys):
    argv = ['replay', 'scans.mcap', '--json', 'out.json', '--out', 'out.mcap', '--tum', 'out.tum']
    assert main(argv) == 0
    record = json.loads((folder / 'out.json').read_text())
    with open_recording('out.mcap') as recording:
        assert recording.topics == {
            '/diagnostics': Topic(DIAGNOSTICS, 3),
            '/idem_node/transform': Topic(TRANSFORM, 3),
        }
        transforms = [m for _, _, m in recording.messages(['/idem_node/transform'])]
        diagnostics = [m for _, _, m in recording.messages(['/diagnostics'])]
    tum = np.loadtxt('out.tum')
    for frame, transform, diagnostic, line in zip(
        record['frames'], transforms, diagnostics, tum, strict=True
    ):
        expected = np.array(frame['T_target_source'])
        np.testing.assert_allclose(matrix_of(transform), expected, atol=1e-12)
        np.testing.assert_allclose(line[1:4], expected[:3, 3], atol=1e-11)
        assert stamp_ns(transform) == stamp_ns(diagnostic) == frame['stamp_ns']
        assert line[0] == frame['stamp']
        assert (transform.header.frame_id, transform.child_frame_id) == ('map', 'lidar')
        (status,) = diagnostic.status
        values = {value.key: value.value for value in status.values}
        assert float(values['q_tot']) == frame['q_tot']
        assert values['status'] == 'converged'
        assert status.message == f'{values["verdict"]}: {values["verdict_reason"]}'
        assert values['dropped'] == '0'


def test_a_result_says_how_it_was_made(folder, capsys):
    argv = ['replay', 'scans.mcap', '--json', 'out.json', '--out', 'out.mcap', '--a', '1.5']
    assert main(argv) == 0
    embedded = read_embedded('out.mcap')
    made_by = json.loads((folder / 'out.json').read_text())['made_by']
    assert embedded.attachments == {'frames.json': (folder / 'out.json').read_bytes()}
    metadata = embedded.metadata['idem_replay']
    assert set(metadata) == set(made_by)
    assert metadata['method'] == made_by['method'] == 'idem'
    for key in set(made_by) - {'method'}:
        assert json.loads(metadata[key]) == made_by[key], key
    assert made_by['parameters']['a'] == 1.5
    assert made_by['topics']['guess'] == '/initial_guess'
    assert made_by['versions']['numpy'] == np.__version__
    content = (folder / 'scans.mcap').read_bytes()
    assert made_by['input'] == {
        'name': 'scans.mcap',
        'size': len(content),
        'sha256': hashlib.sha256(content).hexdigest(),
    }


def test_but_for_the_times_a_result_is_the_same_every_time(folder, capsys):
    texts = []
    for _ in range(2):
        assert main(['replay', 'scans.mcap', '--json', '-']) == 0
        lines = capsys.readouterr().out.splitlines()
        before_summary = lines[: lines.index(' "summary": {')]
        texts.append([line for line in before_summary if '"time_ms"' not in line])
    assert texts[0] == texts[1]
    assert len(texts[0]) > 100


def test_topics_are_taken_by_name(folder, rng, capsys):
    points = [np.random.default_rng(seed).normal(size=(200, 3)) for seed in range(3)]
    write_mcap(
        'clouds.mcap',
        [(f'cloud_{i}', i, cloud_message(p, 0, 'test')) for i, p in enumerate(points)],
    )
    assert main(['replay', 'clouds.mcap']) == 1
    assert 'cloud_0, cloud_1, cloud_2; choose one' in capsys.readouterr().err
    argv = ['--target-topic', '/cloud_2', '--source-topic', 'cloud_0', '--json', '-']
    main(['replay', 'clouds.mcap', *argv])
    captured = capsys.readouterr()
    (frame,) = json.loads(captured.out)['frames']
    assert frame['translation_error_m'] is None
    assert 'each source starts from the identity' in captured.err


def test_a_recording_cut_off_is_replayed_with_a_warning(folder, rng, capsys):
    write_mcap('long.mcap', scans(rng, n=4, points=25_000))
    content = (folder / 'long.mcap').read_bytes()
    (folder / 'long.mcap').write_bytes(content[: len(content) // 2])
    main(['replay', 'long.mcap', '--voxel-size', '0.2', '--max-iterations', '3'])
    out = capsys.readouterr().out
    assert 'note: long.mcap is cut off' in out
    assert f'of its {len(content) // 2} bytes' in out


def test_a_source_that_is_refused_is_reported_with_the_reason(folder, rng, capsys):
    messages = list(scans(rng))
    messages[1][2].fields.pop()
    write_mcap('bad.mcap', messages)
    assert main(['replay', 'bad.mcap']) == 0
    out = capsys.readouterr().out
    assert '2 registered' in out
    assert "1 x source: it has no field 'z'; its fields: x, y" in out


def test_one_topic_as_target_and_source_registers_each_scan_to_the_one_before(folder, capsys):
    topics = ['--target-topic', '/source', '--source-topic', '/source']
    main(['replay', 'scans.mcap', *topics, '--initial-guess-type', 'identity', '--json', 'r.json'])
    out = capsys.readouterr().out
    frames = json.loads((folder / 'r.json').read_text())['frames']
    assert [frame['target_frame'] for frame in frames] == ['lidar', 'lidar']
    assert 'target and source are one topic, /source' in out
    assert '--sequence scan' in out
    assert 'which is never its own target' in out


def test_where_no_pair_is_registered_it_says_so_and_the_exit_code_is_1(folder, capsys):
    result = ['--json', 'r.json', '--tum', 'r.tum']
    assert main(['replay', 'scans.mcap', '--voxel-size', '1000', *result]) == 1
    out = capsys.readouterr().out
    assert '0 registered\n3 not registered (3 too_few_points)\n' in out
    assert len(json.loads((folder / 'r.json').read_text())['frames']) == 3
    assert main(['replay', '--again', 'r.json']) == 0  # repeated to the bit is what it asks
    assert '3 of 3 frames agree' in capsys.readouterr().out


def test_an_audit_has_neither_before_nor_after(folder, capsys):
    assert main(['replay', 'scans.mcap', '--mode', 'audit']) == 1  # no guess is aligned
    out = capsys.readouterr().out
    rows = {line[:24].strip(): line[24:].split() for line in out.splitlines()}
    assert rows['idem, audit'] == ['median', 'p90']
    assert list(map(float, rows['rotation error [deg]'])) == pytest.approx([2.0, 2.0])
    assert len(rows['q_tot [nat]']) == 2
    assert rows['milliseconds'][2:] == ['(p95)']
    assert '3 judged, none moved (3 audited)\nverdicts: 3 ' in out
    for word in ('before', 'after', 'registered'):
        assert word not in out


def test_an_audit_is_content_where_a_pose_is_aligned(folder, rng, capsys):
    write_mcap('exact.mcap', scans(rng, points=3000, perturbation=(0.0, 0.0)))
    assert main(['replay', 'exact.mcap', '--mode', 'audit']) == 0
    assert 'verdicts: 3 aligned' in capsys.readouterr().out


def test_of_several_methods_each_must_register_some(folder, capsys, monkeypatch):
    pytest.importorskip('small_gicp')
    argv = ['replay', 'scans.mcap', '--voxel-size', '0.1', '--method', 'idem,gicp']
    assert main(argv) == 0
    from idem_ros.replay import peers

    monkeypatch.setattr(peers, 'LEAST_POINTS', 10**9)
    assert main(argv) == 1
    assert '3 not registered (3 too_few_points)' in capsys.readouterr().out


BAD_INPUT = [  # arguments, exit code, words of the error
    (['nowhere.mcap'], 1, 'nowhere.mcap does not exist'),
    (['garbage.mcap'], 1, 'garbage.mcap cannot be read'),
    (['transforms.mcap'], 1, 'has no PointCloud2 topic left for the target'),
    (['nothing.mcap'], 1, 'none of its 3 points is usable'),
    (['scans.mcap', '--source-topic', '/lidar'], 1, "has no topic '/lidar'"),
    (['scans.mcap', '--guess-topic', '/source'], 1, 'must be geometry_msgs'),
    (['scans.mcap', '--tum', 'no/out.tum'], 1, 'no does not exist'),
    (['scans.mcap', '--out', './scans.mcap'], 2, '--out is ./scans.mcap, which would replace the'),
    (['scans.mcap', '--json', 'out.tum'], 2, '--json out.tum and --tum out.tum are one file'),
    (['sqlite3', '--json', 'sqlite3/out.json'], 2, 'within the recording sqlite3'),
    (['scans.mcap', '--out', 'out.bag'], 2, 'must end in .mcap'),
    (['scans.mcap', '--a', '-1'], 2, 'a is -1.0'),
    ([], 2, 'no recording is named'),
    (['scans.mcap', '--every', '0'], 2, 'every is 0'),
    (['scans.mcap', '--start', '-1'], 2, 'start is -1.0'),
    (['scans.mcap', '--mode', 'audit', '--sequence', 'scan'], 2, 'has no poses to judge'),
    (['scans.mcap', '--duration', 'nan'], 2, 'duration is nan'),
    (['scans.mcap', '--start', '1000'], 1, '3 sources left out'),
    (['scans.mcap', '--method', 'gicp', '--max-distance', '0'], 2, 'max_distance is 0.0'),
    (['scans.mcap', '--method', 'idem,gicp', '--json', '-'], 2, 'need a file each'),
    (['scans.mcap', '--params', 'none.yaml'], 2, 'none.yaml cannot be read'),
    (['scans.mcap', '--params', 'out.json'], 2, 'out.json holds no node'),
    (['--again', 'none.mcap'], 1, 'none.mcap cannot be read'),
    (['--again', 'scans.mcap'], 1, 'scans.mcap is no result of a replay'),
    (['--again', 'scans.mcap', '--a', '2', '--every', '2'], 2, 'leave out --a, --every'),
]


def test_bad_input_gets_one_line_and_leaves_old_outputs(folder, rng, capsys):
    (folder / 'garbage.mcap').write_bytes(b'garbage' * 10)
    write_mcap('transforms.mcap', (m for m in scans(rng) if m[0] == '/ground_truth'))
    nothing = [m for m in scans(rng, n=1) if m[0] != '/source'] + [
        ('/source', 2 * 10**9, cloud_message(np.full((3, 3), np.nan), 1_100_000_000, 'lidar'))
    ]
    write_mcap('nothing.mcap', nothing)
    write_sqlite3(folder / 'sqlite3', list(scans(rng)))
    outputs = ['out.json', 'out.mcap', 'out.tum']
    for output in outputs:
        (folder / output).write_text('old')
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    options = ['--json', 'out.json', '--out', 'out.mcap', '--tum', 'out.tum']
    for argv, code, words in BAD_INPUT:
        assert main(['replay', *options, *argv]) == code, argv
        captured = capsys.readouterr()
        assert captured.out == ''
        assert captured.err.startswith('idem: error: ')
        assert captured.err.count('\n') == 1
        assert words in captured.err
        assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_points_left_out_and_guesses_are_chosen_as_in_the_node(folder, capsys):
    argv = ['replay', 'scans.mcap', '--initial-guess-type', 'identity', '--max-points', '300']
    assert main([*argv, '--json', '-']) == 0
    captured = capsys.readouterr()
    record = json.loads(captured.out)
    for frame in record['frames']:
        assert frame['T_guess'] == np.eye(4).tolist()
        assert (frame['points_source'], frame['thinned']) == (300, 200)
    assert 'points left out for max_points: 600' in captured.err
    assert 'no guess topic' not in captured.err


def test_a_guess_that_the_recording_lacks_is_an_error_of_one_line(folder, capsys):
    assert main(['replay', 'scans.mcap', '--initial-guess-type', 'odometry']) == 1
    error = capsys.readouterr().err
    assert error.startswith('idem: error: scans.mcap has no Odometry topic left')
    assert error.count('\n') == 1


@pytest.mark.parametrize('end', ['success', 'error', 'interrupt'])
def test_no_temporary_file_is_left_however_it_ends(folder, monkeypatch, capsys, end):
    from idem_ros.commands import replay

    def ending(messages, total):
        for i, message in enumerate(messages):
            if i == 8 and end == 'error':
                raise OSError('the cable is out')
            if i == 8 and end == 'interrupt':
                raise KeyboardInterrupt
            yield message

    (folder / 'temporary').mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(folder / 'temporary'))
    monkeypatch.setattr(replay, '_progress', ending)
    argv = ['replay', 'scans.mcap', '--json', 'out.json', '--out', 'out.mcap', '--tum', 'out.tum']
    assert main(argv) == {'success': 0, 'error': 1, 'interrupt': 130}[end]
    written = [] if end == 'error' else ['out.json', 'out.mcap', 'out.tum']
    left = sorted(str(path.relative_to(folder)) for path in folder.rglob('*'))
    assert left == [*written, 'scans.mcap', 'temporary']
    frames = {'success': 3, 'interrupt': 2}.get(end)
    assert not frames or len(json.loads((folder / 'out.json').read_text())['frames']) == frames


def test_a_full_disk_is_one_line_and_keeps_what_stood_there(folder, monkeypatch, capsys):
    (folder / 'out.json').write_text('old')

    def full(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'pwrite', full)
    assert main(['replay', 'scans.mcap', '--json', 'out.json']) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f'idem: error: cannot write what is found to {tempfile.gettempdir()}')
    assert (folder / 'out.json').read_text() == 'old'
