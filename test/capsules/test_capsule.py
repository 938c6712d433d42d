import io
import json
from dataclasses import replace

import numpy as np
import pytest
from recordings import scans

from idem_ros.capsules import LaterCapsule, Seen, read_capsule, write_capsule
from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry.se3 import exp
from idem_ros.maps.open_map import MapPoints
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.map_target import MapConfig, MapTarget
from idem_ros.pairing.pair import Pair
from idem_ros.recording import writer
from idem_ros.recording.messages import diagnostics_message
from idem_ros.recording.reader import open_recording
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings
from idem_ros.results.result_file import read_result

SETTINGS = Settings(RegistrationConfig(), PreprocessingConfig(max_range=50.0))
GUESS = exp(np.array([0.01, 0.02, -0.013, 0.031, -0.017, 0.0037]))  # of no short decimals


@pytest.fixture(scope='module')
def seen():
    rng = np.random.default_rng(2)
    (_, _, target), (_, _, source), _, _ = scans(rng, n=1)
    pair = Pair(target, source, Guess(GUESS, 'map', 'lidar'))
    refinement = Refiner(SETTINGS.config, False, SETTINGS.preprocessing).refine(pair)
    told = ('/idem_node', 'registration', 0, 'aligned: so', {'status': 'converged'}, 5)
    return Seen(pair, SETTINGS, refinement, diagnostics=(told,) * 3)


@pytest.fixture(scope='module')
def capsule(seen, tmp_path_factory):
    path = tmp_path_factory.mktemp('capsules') / 'capsule.mcap'
    write_capsule(path, seen)
    return path


def test_a_capsule_replayed_gives_the_same_to_the_bit(seen, capsule):
    settings, guesses = read_capsule(capsule)
    assert settings.preprocessing == SETTINGS.preprocessing
    assert (guesses[seen.pair.stamp] == GUESS).all()
    (replayed,) = replay_each(capsule, [settings], guesses=guesses)
    (frame,) = replayed.frames
    result, then = frame.refinement.result, seen.refinement.result
    assert (result.T_target_source == then.T_target_source).all()
    assert (result.q_tot, result.status) == (then.q_tot, then.status)
    assert result.assessment.p_aligned == then.assessment.p_aligned


def test_idem_replay_takes_it_with_its_parameters(seen, capsule, tmp_path, capsys):
    out = tmp_path / 'again.json'
    assert main(['replay', str(capsule), '--json', str(out)]) == 0
    (frame,) = json.loads(out.read_text())['frames']
    assert frame['T_target_source'] == seen.refinement.result.T_target_source.tolist()
    assert 'a capsule of a node' in capsys.readouterr().out
    assert main(['replay', str(capsule), '--max-range', '40', '--json', str(out)]) == 0
    assert json.loads(out.read_text())['made_by']['parameters']['max_range'] == 40.0


def test_it_is_a_result_that_can_be_shown_and_gated(capsule, tmp_path):
    assert read_result(capsule).counts['frames'] == 1
    assert main(['show', str(capsule), '--out', str(tmp_path / 'page.html')]) == 0


def test_the_clouds_are_those_that_came_and_the_diagnostics_follow(seen, capsule):
    with open_recording(capsule) as recording:
        messages = list(recording.messages(['/target', '/source', '/diagnostics']))
    clouds = {topic: message for topic, _, message in messages if topic != '/diagnostics'}
    for topic, message in {'/target': seen.pair.target, '/source': seen.pair.source}.items():
        assert (read_points(clouds[topic]).points == read_points(message).points).all()
    assert len(messages) == 2 + 1 + len(seen.diagnostics)


def test_a_refused_source_is_kept_with_its_reason(seen, tmp_path, capsys):
    path = tmp_path / 'refused.mcap'
    refused = Seen(seen.pair, SETTINGS, None, 'the source has 3 points')
    write_capsule(path, refused)
    assert read_result(path).counts == {**read_result(path).counts, 'frames': 0, 'refused': 1}
    with open_recording(path) as recording:
        assert {'/target', '/source', '/initial_guess'} <= set(recording.topics)
    assert main(['replay', str(path)]) == 0  # what was refused then may be refined today


def test_another_recording_is_no_capsule(tmp_path):
    path = tmp_path / 'scans.mcap'
    writer.write_mcap(path, scans(np.random.default_rng(0), n=1))
    assert read_capsule(path) is None
    assert read_capsule(tmp_path / 'none.mcap') is None


def test_a_capsule_of_a_later_version_is_refused_in_one_line(tmp_path, capsys):
    path, told = tmp_path / 'later.mcap', diagnostics_message('/n', 't', 0, '', {}, 0)
    with (tmp_path / 'record').open('w+b') as record:
        writer.write_mcap(
            path,
            [('/diagnostics', 0, told)],
            metadata={'idem_capsule': {'version': '2'}},
            attachments={'frames.json': ('application/json', record)},
        )
    with pytest.raises(LaterCapsule, match='version 2'):
        read_capsule(path)
    assert main(['replay', str(path)]) == 1
    assert 'is a capsule of version 2; this one reads 1' in capsys.readouterr().err


def test_a_capsule_cut_off_is_no_traceback(capsule, tmp_path, capsys):
    content = capsule.read_bytes()
    for share in (0.2, 0.5, 0.99):
        path = tmp_path / 'cut.mcap'
        path.write_bytes(content[: int(share * len(content))])
        assert main(['replay', str(path)]) in (0, 1)
        assert 'Traceback' not in capsys.readouterr().err


SPOILT = {
    'no json': b'{"frames": [',
    'no record': b'[]',
    'deep': b'{"frames": ' + b'[' * 500 + b']' * 500 + b'}',
    'no settings': b'{"frames": [], "summary": SUMMARY}',
    'another map': b'{"frames": [], "summary": SUMMARY, "made_by": {"parameters": '
    b'{"target_file": "/dev/zero"}}}',
    'no parameter': b'{"frames": [], "summary": SUMMARY, "made_by": {"parameters": {"a": "x"}}}',
    'no frame': b'{"frames": [{"stamp_ns": "now"}], "summary": SUMMARY, '
    b'"made_by": {"parameters": {}}}',
    'no pose': b'{"frames": [{"stamp_ns": 5, "T_guess": [[1]]}], "summary": SUMMARY, '
    b'"made_by": {"parameters": {}}}',
}
SUMMARY = b'{"frames": 0, "refused": 0, "dropped": 0, "unpaired": 0}'


@pytest.mark.parametrize('name', SPOILT)
def test_what_a_capsule_says_of_itself_is_checked_and_opens_no_map(tmp_path, capsys, name):
    path = tmp_path / 'spoilt.mcap'
    text = io.BytesIO(SPOILT[name].replace(b'SUMMARY', SUMMARY))
    writer.write_mcap(
        path,
        scans(np.random.default_rng(0), n=1),
        metadata={'idem_capsule': {'version': '1'}},
        attachments={'frames.json': ('application/json', text)},
    )
    assert main(['replay', str(path)]) == (0 if name == 'another map' else 1)
    said = capsys.readouterr().err
    assert said.count('idem: error: ') == (0 if name == 'another map' else 1)


def test_of_a_map_from_a_file_what_lies_around_the_source_is_kept(seen, tmp_path):
    points = read_points(seen.pair.target).points
    far = points + (1000.0, 0.0, 0.0)
    map_ = MapTarget.of(MapPoints(np.concatenate([points, far]), 'a map'), 'map')
    settings = replace(SETTINGS, map=MapConfig(target_file='map.npy'))
    pair = Pair(map_, seen.pair.source, Guess(GUESS, 'map', 'lidar'))
    refinement = Refiner(SETTINGS.config, False, SETTINGS.preprocessing).refine(pair)
    path = tmp_path / 'capsule.mcap'
    write_capsule(path, Seen(pair, settings, refinement))
    with open_recording(path) as recording:
        ((_, _, target),) = recording.messages(['/target'])
    np.testing.assert_allclose(np.sort(read_points(target).points, 0), np.sort(points, 0))
    assert not read_capsule(path)[0].map.target_file
    write_capsule(path, Seen(pair, settings, None, 'no target'))
    assert read_capsule(path) is not None
