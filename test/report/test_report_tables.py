import csv

import numpy as np
import pytest
from replayed import changed, write_replayed

from idem_ros.report import tables
from idem_ros.report.runs import read_runs


def columns(table):
    return dict(zip(table.header, zip(*table.rows, strict=True), strict=True))


@pytest.fixture
def run(tmp_path):
    return read_runs([write_replayed(tmp_path)])[0]


def test_outcomes_count_every_source_and_status(tmp_path):
    def change(record):
        record['frames'][1]['status'] = 'no_overlap'
        record['summary'].update(refused=2, dropped=3, unpaired=5)

    runs = read_runs([changed(write_replayed(tmp_path), change)])
    row = columns(tables.outcomes(runs))
    assert row['status'] == ('3 converged, 1 no_overlap',)
    counts = [row[name][0] for name in ('frames', 'refused', 'dropped', 'unpaired')]
    assert counts == [4, 2, 3, 5]
    assert row['time max [ms]'] == (run_max(runs[0], 'time_ms'),)


def run_max(run, name):
    return run.values(name).max()


def test_before_and_after_hold_the_statistics_of_both(run):
    table = tables.before_and_after([run])
    row = dict(zip(table.header, table.rows[0], strict=True))
    assert row['number'] == 'translation error [m]'
    before, after = run.values('translation_error_m_before'), run.values('translation_error_m')
    assert row['median before'] == np.median(before)
    assert row['p90 after'] == np.percentile(after, 90)
    assert row['max after'] == after.max()


def test_a_measure_that_no_frame_has_is_left_out(tmp_path):
    (run,) = read_runs([write_replayed(tmp_path, truth=False)])
    numbers = columns(tables.before_and_after([run]))['number']
    assert not [name for name in numbers if 'error' in name]
    assert 'q_tot [nat]' in numbers


def test_settings_are_shown_side_by_side(tmp_path):
    result = write_replayed(tmp_path)
    made_by = {'method': 'idem', 'parameters': {'voxel_size': None, 'crop_min': ['-inf', 1.0]}}
    one = changed(result, lambda r: r.update(made_by=made_by), 'one')
    made_by = {'method': 'gicp', 'parameters': {'voxel_size': 0.5}, 'input': {'sha256': 'ab'}}
    two = changed(result, lambda r: r.update(made_by=made_by), 'two')
    table = tables.parameters(read_runs([one, two, result]))
    assert table.header == ('setting', 'one', 'two', 'result')
    assert set(table.rows) == {
        ('voxel_size', 'none', '0.5', None),
        ('crop_min', '-inf, 1.0', None, None),
        ('method', 'idem', 'gicp', None),
        ('input.sha256', None, 'ab', None),
    }


def test_the_frames_are_complete_and_read_back_to_the_bit(run):
    lines = list(csv.DictReader(tables.csv_text(tables.frames(run)).splitlines()))
    assert len(lines) == 4
    for i, line in enumerate(lines):
        frame = run.result.frames[i]
        assert int(line['frame']) == i
        assert int(line['stamp_ns']) == frame['stamp_ns']
        assert float(line['q_tot']) == frame['q_tot']
        T = [[float(line[f'T_target_source_{j}{k}']) for k in range(4)] for j in range(3)]
        assert frame['T_target_source'][:3] == T
    assert lines[0]['second_difference_m'] == ''
    assert float(lines[1]['second_difference_m']) == run.values('second_difference_m')[1]


def test_text_with_commas_and_quotes_survives_csv_and_its_line_ends_become_escapes():
    cell = 'a,"b"\nc'
    text = tables.csv_text(tables.Table(('x', 'y'), [(cell, None)]))
    assert list(csv.reader(text.splitlines(keepends=True))) == [
        ['x', 'y'],
        [cell.replace('\n', r'\n'), ''],
    ]


def test_worst_frames_are_listed_in_the_order_given(run):
    table = tables.worst(run, np.array([2, 0]))
    assert columns(table)['frame'] == (2, 0)
    assert columns(table)['q_tot [nat]'] == tuple(run.values('q_tot')[[2, 0]])


def test_verdicts_are_summed_up_with_reason_sigma_and_basin_and_shown_of_the_worst(run):
    table = columns(tables.verdicts([run]))
    verdicts = [frame['verdict'] for frame in run.result.frames]
    assert sum(table['frames']) == len(verdicts)
    assert sum(table['share']) == pytest.approx(1.0)
    assert set(table['verdict']) == set(verdicts)
    which = np.array([verdict == table['verdict'][0] for verdict in verdicts])
    assert table['basin [share] median'][0] == np.median(run.values('basin')[which])
    assert 0 < table['sigma of the position [m] median'][0] < 1
    worst = columns(tables.worst(run, np.array([1])))
    assert worst['verdict'] == (verdicts[1],)
    assert worst['reason'] == (run.result.frames[1]['verdict_reason'] or None,)
    covariance = np.array(run.result.frames[1]['covariance'])
    largest = np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1])
    assert worst['sigma of the position [m]'] == pytest.approx((largest,))
