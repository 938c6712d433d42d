import itertools
import json

import numpy as np
import pytest

from benchmarks import evaluation
from benchmarks.commands.main import main
from benchmarks.goal import Goal
from idem_ros.core import RegistrationConfig
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay

DEMO = RegistrationConfig(voxel_size=0.5)


def test_small_scans_are_made_as_they_are_needed_and_the_same_every_time():
    first, again = (
        list(itertools.islice(evaluation.small_scans(10**9), 8)) for _ in range(2)
    )  # a billion of them would not end
    assert [topic for topic, _, _ in first] == [
        '/target',
        *['/source', '/initial_guess', '/ground_truth'] * 2,
        '/source',
    ]
    times = [log_time for _, log_time, _ in first]
    assert times == sorted(set(times))
    for (_, _, a), (_, _, b) in zip(first, again, strict=True):
        if hasattr(a, 'data'):
            np.testing.assert_array_equal(a.data, b.data)


def test_no_cloud_is_kept_over_a_recording_streamed_from_disk(tmp_path):
    points = 6000  # so many that a few scans kept would show beside all else
    missed, kept = evaluation.memory(tmp_path, 40, 120, points)
    assert missed.reached
    assert kept.measured < 12 * points  # a cloud takes twice as much
    assert 'over 40 scans' in kept.figure
    assert kept.at_most == 200


def test_the_small_scans_are_refined_towards_their_truth(tmp_path):
    path = tmp_path / 'small.mcap'
    write_mcap(path, evaluation.small_scans(10))
    frames = replay(path).frames
    before, after = (
        np.median([getattr(frame, error)().rotation_deg for frame in frames])
        for error in ('error_before', 'error_after')
    )
    assert after < before / 2


def test_a_repeated_recording_has_every_source_again_later_and_the_target_once(tmp_path):
    path = tmp_path / 'small.mcap'
    write_mcap(path, evaluation.small_scans(4))
    write_mcap(tmp_path / 'twice.mcap', evaluation.repeated(path, 3))
    once, thrice = replay(path), replay(tmp_path / 'twice.mcap')
    assert len(thrice.frames) == 12
    assert (thrice.dropped, thrice.unpaired, len(thrice.refused)) == (0, 0, 0)
    stamps = [frame.refinement.stamp for frame in thrice.frames]
    assert stamps == sorted(set(stamps))
    for k, frame in enumerate(thrice.frames):
        expected = once.frames[k % 4].refinement.result.T_target_source
        np.testing.assert_array_equal(frame.refinement.result.T_target_source, expected)
    with open_recording(tmp_path / 'twice.mcap') as recording:
        assert recording.topics['/target'].count == 1


def test_reading_and_pairing_are_a_share_of_the_refinements():
    (share,) = evaluation.reading(evaluation._demo(), DEMO, 1)
    assert share.measured > 0
    assert share.at_most == 15.0
    assert '21 scans' in share.figure


def test_one_and_two_processes_evaluate_all_recordings(tmp_path):
    small = tmp_path / 'small.mcap'
    write_mcap(small, evaluation.small_scans(2))
    *done, ratio = evaluation.jobs(small, tmp_path, RegistrationConfig(), 2, 1)
    assert [goal.measured for goal in done] == [0, 0]
    assert ratio.measured > 0
    assert ratio.at_most == pytest.approx(1 / 1.7)


@pytest.mark.parametrize(('measured', 'code'), [(0.5, 0), (2.0, 1)])
def test_a_missed_figure_ends_with_exit_code_1(monkeypatch, tmp_path, capsys, measured, code):
    monkeypatch.setattr(evaluation, 'measure', lambda *_: [Goal('x', measured, 1.0)])
    out = tmp_path / 'out.json'
    assert main(['evaluation', '--json', str(out)]) == code
    assert json.loads(out.read_text())['goals'][0]['reached'] == (code == 0)
    assert ('MISSED' in capsys.readouterr().out) == bool(code)
