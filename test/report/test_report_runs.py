import numpy as np
import pytest
from replayed import changed, write_replayed

from idem_ros.report.runs import read_runs
from idem_ros.results.result_file import UnreadableResult


def test_every_number_of_a_result_is_a_column(tmp_path):
    (run,) = read_runs([write_replayed(tmp_path)])
    assert run.name == 'result'
    np.testing.assert_allclose(run.seconds, [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(run.values('q_tot'), run.result.values('q_tot'))
    assert np.isfinite(run.values('translation_error_m_before')).all()
    assert np.isnan(run.values('nothing of the kind')).all()


def test_smoothness_is_known_within_the_trajectory_before_and_after(tmp_path):
    (run,) = read_runs([write_replayed(tmp_path)])
    for name in ('second_difference_m', 'second_difference_deg_before'):
        np.testing.assert_array_equal(np.isnan(run.values(name)), [True, False, False, True])


def test_results_of_one_recording_share_a_time_axis(tmp_path):
    result = write_replayed(tmp_path)
    later = changed(result, lambda record: record['frames'].pop(0))
    other = changed(later, lambda record: record.update(bag='other.mcap'), 'other')
    first, second, third = read_runs([result, later, other])
    np.testing.assert_allclose(second.seconds, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(third.seconds, [0, 0.1, 0.2])
    assert [run.name for run in (first, second, third)] == ['result', 'changed', 'other']


def test_results_of_one_name_are_told_apart_by_their_folders(tmp_path):
    paths = []
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        paths.append(write_replayed(tmp_path / name))
    assert [run.name for run in read_runs(paths)] == [str(path) for path in paths]


def test_a_transform_that_is_none_is_named_by_file_and_frame(tmp_path):
    def break_(record):
        record['frames'][2]['T_target_source'][0][0] = 7.0

    path = changed(write_replayed(tmp_path), break_)
    with pytest.raises(
        UnreadableResult, match=r'changed.json .*frames.2.T_target_source is a list'
    ):
        read_runs([path])


def test_a_result_without_transforms_has_no_smoothness(tmp_path):
    def strip(record):
        for frame in record['frames']:
            del frame['T_target_source'], frame['T_guess']

    (run,) = read_runs([changed(write_replayed(tmp_path), strip)])
    assert 'second_difference_m' not in run.columns
    assert 'q_tot' in run.columns
