import os

import numpy as np
import pytest
from recordings import scans
from results import write_result

from idem_ros.commands.main import main
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay
from idem_ros.results.result_file import COUNTS, UnreadableResult, read_result, record_text
from idem_ros.results.summary import json_record

FRAME = '{"stamp_ns": 1}'
SUMMARY = '{"frames": 1, "refused": 0, "dropped": 0, "unpaired": 0}'
TWO = SUMMARY.replace('1', '2', 1)


def test_what_a_replay_wrote_comes_back(tmp_path, rng):
    write_mcap(tmp_path / 'scans.mcap', scans(rng))
    replayed = replay(tmp_path / 'scans.mcap')
    text = ''.join(record_text(json_record(replayed)))
    (tmp_path / 'result.json').write_text(text)
    result = read_result(tmp_path / 'result.json')
    assert result.counts == {'frames': 3, **dict.fromkeys(result.counts.keys() - {'frames'}, 0)}
    assert {'interrupted', 'files_missing'} < set(result.counts)
    assert set(COUNTS) < set(result.counts)
    assert result.bag == str(tmp_path / 'scans.mcap')
    expected = {'translation_error_m', 'rotation_error_deg_before', 'q_tot', 'time_ms', 'overlap'}
    assert expected <= set(result.numbers())
    assert not {'stamp', 'stamp_ns', 'status', 'T_guess'} & set(result.numbers())
    times = [frame.refinement.time_ms for frame in replayed.frames]
    np.testing.assert_array_equal(result.values('time_ms'), times)


def test_an_mcap_holds_the_same_as_the_json_beside_it(tmp_path, rng, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_mcap('scans.mcap', scans(rng))
    assert main(['replay', 'scans.mcap', '--json', 'a.json', '--out', 'a.mcap']) == 0
    of_json, of_mcap = read_result('a.json'), read_result('a.mcap')
    assert of_mcap.record == of_json.record
    assert (of_mcap.frames, of_mcap.counts) == (of_json.frames, of_json.counts)
    assert of_mcap.made_by['input']['name'] == 'scans.mcap'


def test_a_recording_that_is_no_result_is_refused(tmp_path, rng):
    write_mcap(tmp_path / 'scans.mcap', scans(rng))
    with pytest.raises(UnreadableResult, match='a recording without an attachment frames.json'):
        read_result(tmp_path / 'scans.mcap')


def test_what_is_unknown_is_nan(tmp_path):
    write_result(tmp_path / 'a.json', q_tot=[1.0, None, 3], overlap=[None] * 3)
    result = read_result(tmp_path / 'a.json')
    np.testing.assert_array_equal(result.values('q_tot'), [1, np.nan, 3])
    assert np.isnan(result.values('overlap')).all()
    assert np.isnan(result.values('anything else')).all()
    assert result.numbers() == ['q_tot', 'overlap']


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'it is no JSON'),
        ('{"frames": [', 'it is no JSON'),
        ('[' * 100_000, 'it is no JSON'),
        ('[]', 'it lacks "frames" or "summary"'),
        ('{"target": "a.ply", "q_tot": 1}', 'it lacks "frames" or "summary"'),
        (f'{{"frames": [1], "summary": {SUMMARY}}}', 'frames.0 is 1: '),
        (f'{{"frames": [{FRAME}], "summary": {{"frames": 1}}}}', 'summary.refused is missing'),
        (f'{{"frames": [{{}}], "summary": {SUMMARY}}}', 'frames.0.stamp_ns is missing'),
        (f'{{"frames": [{{"stamp_ns": 1{"0" * 400}}}]}}', 'is no number of JSON'),
        (
            f'{{"frames": [{{"stamp_ns": 1, "q": NaN}}], "summary": {SUMMARY}}}',
            'NaN is no number',
        ),
        (
            '{"frames": [{"stamp_ns": 1, "q": 1}, {"stamp_ns": 2, "q": "x"}], '
            f'"summary": {TWO}}}',
            "'q' as a number and as something else",
        ),
        (
            '{"frames": [], "summary": ' + SUMMARY + '}',
            'its summary tells of 1 frames, and it holds 0',
        ),
        (
            f'{{"frames": [{{"stamp_ns": 1, "translation_error_m": -1}}], "summary": {SUMMARY}}}',
            'frames.0.translation_error_m is -1',
        ),
    ],
)
def test_what_is_no_result_is_refused_in_one_line(tmp_path, text, words):
    (tmp_path / 'a.json').write_text(text)
    with pytest.raises(UnreadableResult) as refused:
        read_result(tmp_path / 'a.json')
    assert words in str(refused.value)
    assert str(refused.value).startswith(f'{tmp_path / "a.json"} is no result of a replay')
    assert '\n' not in str(refused.value)


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path):
    (tmp_path / 'a.mcap').write_bytes(b'\x89MCAP0\r\n\xff')
    (tmp_path / 'a.json').write_bytes(b'\xff')
    cases = (
        ('a.mcap', 'a.mcap is cut off or damaged'),
        ('a.json', 'no JSON'),
        ('none.json', 'cannot be read'),
    )
    for name, words in cases:
        with pytest.raises(UnreadableResult, match=words):
            read_result(tmp_path / name)


def test_a_device_that_never_ends_and_a_fifo_that_nobody_writes_to_are_no_result(tmp_path):
    os.mkfifo(tmp_path / 'fifo')
    for path in ('/dev/zero', '/dev/null', tmp_path / 'fifo'):
        with pytest.raises(UnreadableResult, match='it must be a file'):
            read_result(path)
