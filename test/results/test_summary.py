import json
from dataclasses import replace

import numpy as np
import pytest
from recordings import scans

from idem_ros.core import Status, Verdict
from idem_ros.pairing.pair import Refusal
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay
from idem_ros.results.result_file import record_text
from idem_ros.results.summary import json_record, summary, table


@pytest.fixture(scope='module')
def replayed(tmp_path_factory):
    path = tmp_path_factory.mktemp('summary') / 'scans.mcap'
    write_mcap(path, scans(np.random.default_rng(0)))
    return replay(path)


def without_truth(replayed):
    frames = tuple(replace(frame, truth=None) for frame in replayed.frames)
    return replace(replayed, frames=frames, topics=replace(replayed.topics, truth=None))


def test_the_record_has_what_the_readme_promises(replayed):
    record = json.loads(''.join(record_text(json_record(replayed))))
    assert list(record) == ['bag', 'method', 'frames', 'summary', 'notes']
    assert record['bag'] == replayed.path
    frame = record['frames'][0]
    refinement = replayed.frames[0].refinement
    assert (frame['stamp'], frame['stamp_ns']) == (1.1, 1_100_000_000)
    assert frame['T_target_source'] == refinement.result.T_target_source.tolist()
    assert frame['q_tot'] == refinement.result.q_tot
    assert frame['status'] == 'converged'
    assert frame['time_ms'] == refinement.time_ms
    assert frame['translation_error_m'] < frame['translation_error_m_before']
    assert frame['rotation_error_deg'] < frame['rotation_error_deg_before']


def test_the_summary_is_of_all_frames(replayed):
    numbers = summary(replayed)
    assert numbers['frames'] == 3
    times = [frame.refinement.time_ms for frame in replayed.frames]
    assert numbers['time_ms'] == {
        'median': np.median(times),
        'p95': pytest.approx(np.percentile(times, 95)),
    }
    after = [frame.error_after().rotation_deg for frame in replayed.frames]
    assert numbers['rotation_error_deg']['after'] == {
        'median': np.median(after),
        'p90': pytest.approx(np.percentile(after, 90)),
    }
    before = [frame.refinement.q_tot_before for frame in replayed.frames]
    assert numbers['q_tot']['before']['p90'] == pytest.approx(np.percentile(before, 90))
    assert numbers['rotation_error_deg']['before']['median'] == pytest.approx(2.0, abs=1e-6)
    assert numbers['translation_error_m']['after']['median'] < 0.05


def test_what_is_unknown_is_null(replayed):
    record = json_record(without_truth(replayed))
    first = next(record['frames'])
    assert first['translation_error_m'] is None
    assert first['rotation_error_deg_before'] is None
    unknown = {'median': None, 'p90': None}
    assert record['summary']['translation_error_m'] == {'before': unknown, 'after': unknown}


def test_no_frames_are_a_valid_record(replayed):
    record = json_record(replace(replayed, frames=()))
    assert record['summary']['frames'] == 0
    assert record['summary']['time_ms'] == {'median': None, 'p95': None}
    assert json.loads(''.join(record_text(record)))['frames'] == []


def test_the_table_shows_errors_only_with_truth(replayed):
    assert 'rotation error [deg]' in table(replayed)
    assert 'rotation error' not in table(without_truth(replayed))
    assert 'truth none' in table(without_truth(replayed))


def test_the_table_accounts_for_every_source(replayed):
    refused = tuple(Refusal(stamp, f'reason {stamp // 2}') for stamp in range(14))
    text = table(
        replace(
            replayed,
            refused=refused,
            dropped=4,
            unpaired=5,
            unpaired_for='initial_guess',
            notes=('it was cut off',),
        )
    )
    assert '3 registered (3 converged)' in text
    assert '14 refused:' in text
    assert '  2 x reason 0' in text
    assert 'and 2 other reasons' in text
    assert '4 dropped' in text
    assert '5 unpaired at the end: no initial_guess for them' in text
    assert 'note: it was cut off' in text


def test_what_is_registered_is_told_from_what_is_not(replayed):
    def ended(frame, status, verdict):
        said = replace(frame.refinement.result.assessment, verdict=verdict)
        result = replace(frame.refinement.result, status=status, assessment=said)
        return replace(frame, refinement=replace(frame.refinement, result=result))

    first, second, third = replayed.frames
    frames = (
        ended(first, Status.CONVERGED, Verdict.MISALIGNED),
        ended(second, Status.MAX_ITERATIONS, Verdict.ALIGNED),
        ended(third, Status.MAX_ITERATIONS, Verdict.NOT_CONVERGED),
    )
    lines = table(replace(replayed, frames=frames)).splitlines()
    assert '1 registered (1 max_iterations)' in lines
    assert '2 not registered (1 misaligned, 1 max_iterations)' in lines


def test_points_left_out_are_counted(replayed):
    first = replayed.frames[0]
    refinement = replace(first.refinement, dropped_zero=7, dropped_nonfinite=2)
    text = table(replace(replayed, frames=(replace(first, refinement=refinement),)))
    assert 'not finite: 2' in text
    assert 'exactly zero: 7' in text
