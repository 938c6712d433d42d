import hashlib

import numpy as np
import pytest
from conftest import ROOT

from idem_ros.commands.main import main
from idem_ros.messages.building import CLOUD
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.recording.reader import open_recording
from idem_ros.replay.frames import rotation_error_deg, translation_error_m

DEMO = ROOT / 'bags' / 'demo.mcap'


@pytest.fixture(scope='module')
def messages():
    """The demo's messages by topic."""
    by_topic = {}
    with open_recording(DEMO) as recording:
        for topic, _, message in recording.messages(recording.topics):
            by_topic.setdefault(topic, []).append(message)
    return by_topic


def test_the_demo_is_made_again_bit_for_bit(tmp_path, capsys):
    again = tmp_path / 'demo.mcap'
    assert main(['simulate', '--out', str(again)]) == 0
    digest = hashlib.sha256(DEMO.read_bytes()).hexdigest()
    assert hashlib.sha256(again.read_bytes()).hexdigest() == digest
    assert digest in (ROOT / 'bags' / 'README.md').read_text()


def test_another_seed_makes_another_drive(tmp_path, capsys):
    outs = [tmp_path / f'{seed}.mcap' for seed in (1, 2)]
    for seed, out in zip((1, 2), outs, strict=True):
        assert main(['simulate', '--out', str(out), '--seed', str(seed), '--scans', '2']) == 0
    assert outs[0].read_bytes() != outs[1].read_bytes()


def test_the_demo_holds_what_its_readme_says(messages):
    assert DEMO.stat().st_size <= 5_000_000
    assert {topic: len(found) for topic, found in messages.items()} == {
        '/target': 1,
        '/source': 21,
        '/initial_guess': 21,
        '/ground_truth': 21,
    }
    assert len(read_points(messages['/target'][0]).points) == 80_000
    counts = [len(read_points(message).points) for message in messages['/source']]
    assert min(counts) >= 15_400
    assert max(counts) <= 16_100


def test_the_guesses_are_off_by_what_the_readme_says(messages):
    for guess, truth in zip(messages['/initial_guess'], messages['/ground_truth'], strict=True):
        assert stamp_ns(guess) == stamp_ns(truth)
        guess, truth = matrix_of(guess), matrix_of(truth)
        assert rotation_error_deg(guess, truth) == pytest.approx(1.5)
        assert translation_error_m(guess, truth) == pytest.approx(0.3)


def test_no_point_of_a_scan_is_in_the_map(messages):
    target = {tuple(p) for p in np.round(read_points(messages['/target'][0]).points, 3)}
    for source, truth in zip(messages['/source'], messages['/ground_truth'], strict=True):
        T = matrix_of(truth)
        moved = read_points(source).points @ T[:3, :3].T + T[:3, 3]
        shared = sum(tuple(p) in target for p in np.round(moved, 3))
        assert shared < 10  # by chance: a millimetre is coarse, and there are 15 000 points


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--out', 'x.bag'], 'must end in .mcap'),
        (['--out', 'x.mcap', '--scans', '1'], '--scans 1'),
        (['--out', 'x.mcap', '--seed', '-1'], '--seed is -1'),
    ],
)
def test_misuse_is_refused_in_one_line(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert main(['simulate', *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1
    assert list(tmp_path.iterdir()) == []


def test_a_simulated_rig_is_recorded_with_starts_and_truth(tmp_path):
    path = tmp_path / 'rig.mcap'
    argv = ['simulate', '--lidars', '3', '--scans', '2', '--speed', '2', '--out', str(path)]
    assert main(argv) == 0
    with open_recording(path) as recorded:
        kinds = {name: topic.msgtype for name, topic in recorded.topics.items()}
        assert [name for name, kind in kinds.items() if kind == CLOUD] == [
            f'/lidar_{k}/points' for k in range(3)
        ]
        assert len(list(recorded.messages(['/ground_truth']))) == 2
    assert main(['simulate', '--lidars', '1', '--out', str(path)]) == 2
