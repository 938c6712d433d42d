import numpy as np
import pytest
from replayed import changed, write_replayed

from idem_ros.refinement.debug_clouds import QTotSlice
from idem_ros.report import worst_frames
from idem_ros.report.runs import read_runs
from idem_ros.report.worst_frames import draw, draw_slice, worst

PNG = b'\x89PNG\r\n'


def with_columns(path, **columns):
    def change(record):
        for name, values in columns.items():
            for frame, value in zip(record['frames'], values, strict=True):
                frame[name] = value

    return read_runs([changed(path, change)])[0]


@pytest.fixture
def result(tmp_path):
    return write_replayed(tmp_path)


def test_worst_is_the_greatest_translation_error(result):
    order, sentence = worst(with_columns(result, translation_error_m=[0.1, 0.4, 0.2, 0.3]))
    assert order.tolist() == [1, 3, 2, 0]
    assert sentence == 'by translation error'


def test_frames_without_truth_are_not_ranked_among_those_with_it(result):
    order, sentence = worst(with_columns(result, translation_error_m=[0.1, None, 0.2, None]))
    assert order.tolist() == [2, 0]
    assert '2 frames without ground truth' in sentence


def test_without_truth_status_comes_first_then_q_mean_then_overlap(result):
    run = with_columns(
        result,
        translation_error_m=[None] * 4,
        status=['converged', 'converged', 'no_overlap', 'converged'],
        q_mean=[0.3, 0.5, 0.1, 0.5],
        overlap=[0.5, 0.5, 0.5, 0.4],
    )
    assert worst(run)[0].tolist() == [2, 3, 1, 0]


def test_ten_are_shown_and_of_no_frame_none(tmp_path):
    (run,) = read_runs([write_replayed(tmp_path, n=12)])
    assert len(worst(run)[0]) == 10
    (run,) = read_runs(
        [changed(tmp_path / 'result.json', lambda record: record.update(frames=[]))]
    )
    assert len(worst(run)[0]) == 0


def test_each_has_both_clouds_and_a_slice(result):
    runs = read_runs([result])
    pictures = draw(runs, [[2, 0]])
    assert set(pictures) == {(0, 2), (0, 0)}
    for each in pictures.values():
        first, *steps, last = each.view.names
        assert (first, last) == ('at the guess', 'refined')
        assert len(steps) > 1
        assert len(each.view.q) == len(each.view.means) > 0
        assert min(map(len, (each.view.target, each.view.source))) > 100
        assert list(each.images) == ['q_tot']
        assert all(image.startswith(PNG) for image in each.images.values())
        assert each.note == ''


def test_a_frame_that_was_not_evaluated_has_no_slice_and_says_so(result):
    run = with_columns(result, radius=[0.0] * 4)
    (each,) = draw([run], [[1]]).values()
    assert each.images == {}
    assert each.view
    assert 'nothing was evaluated' in each.note


def test_a_recording_that_is_gone_is_named(result, tmp_path):
    (tmp_path / 'scans.mcap').unlink()
    (each,) = draw(read_runs([result]), [[1]]).values()
    assert each.images == {}
    assert 'scans.mcap does not exist' in each.note


def test_a_frame_that_the_recording_does_not_hold_is_told(result):
    run = with_columns(result, stamp_ns=[1, *(10**9 + i * 10**8 for i in (2, 3, 4))])
    pictures = draw([run], [[0, 1]])
    assert 'holds no such pair' in pictures[0, 0].note
    assert pictures[0, 1].images


def test_a_recording_cut_off_shows_the_frames_it_still_holds(result, tmp_path):
    content = (tmp_path / 'scans.mcap').read_bytes()
    (tmp_path / 'scans.mcap').write_bytes(content[: len(content) // 2])
    pictures = draw(read_runs([result]), [[0, 3]])
    assert not pictures[0, 3].images
    assert pictures[0, 3].note


def test_frames_of_several_results_are_drawn_each_at_its_own_pose(result):
    moved = np.eye(4)
    moved[0, 3] = 1.0
    other = with_columns(result, T_target_source=[moved.tolist()] * 4)
    pictures = draw([read_runs([result])[0], other], [[1], [1]])
    starts = [pictures[number, 1].view.poses[0] for number in (0, 1)]  # from the result's place
    assert not np.allclose(*starts)
    # where the solver of today ends elsewhere there are no steps to the pose of then
    assert pictures[1, 1].view.names == ['at the guess', 'refined']


def test_of_many_frames_fewer_points_each_are_shown(result, monkeypatch):
    monkeypatch.setattr(worst_frames, 'MOST_OF_ALL', 80)
    pictures = draw(read_runs([result]), [[0, 1]])
    assert [len(each.view.source) for each in pictures.values()] == [20, 20]


def test_the_slice_says_its_units(rng):
    slice_ = QTotSlice(np.linspace(-1, 1, 3), rng.random((3, 3)), voxel_size=0.1, radius=0.3)
    axes = draw_slice(slice_, np.zeros(2)).axes
    labels = [label for each in axes for label in (each.get_xlabel(), each.get_ylabel()) if label]
    assert labels == ['shift in x [m]', 'shift in y [m]', 'q_tot [nat]']
