from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from replayed import changed, write_replayed

from idem_ros.report import plots as report_plots
from idem_ros.report.plots import _scale, plots, shown
from idem_ros.report.runs import read_runs

PNG = b'\x89PNG\r\n'


@pytest.fixture
def few_measures(monkeypatch):
    """Errors and q_mean alone: to draw every measure takes seconds."""
    chosen = [m for m in report_plots.MEASURES if m.name in ('translation_error_m', 'q_mean')]
    monkeypatch.setattr(report_plots, 'MEASURES', chosen)


def scaled(values, log=True):
    axes = Figure().subplots()
    is_log = _scale(axes, 'x', np.asarray(values, dtype=float), log)
    return is_log, axes


def test_each_measure_has_its_views_as_svg_and_png(tmp_path):
    drawn = {plot.stem: plot for plot in plots(read_runs([write_replayed(tmp_path)]))}
    views = ('over_time', 'distribution', 'cumulative', 'before_after')
    assert {f'translation_error_m_{view}' for view in views} <= drawn.keys()
    assert {f'q_tot_{view}' for view in views} <= drawn.keys()
    assert 'overlap_cumulative' in drawn
    assert 'overlap_before_after' not in drawn
    for plot in drawn.values():
        assert ElementTree.fromstring(plot.svg).tag.endswith('svg')
        assert plot.png.startswith(PNG)


def test_without_truth_there_are_no_plots_of_errors(tmp_path):
    runs = read_runs([write_replayed(tmp_path, truth=False)])
    stems = [plot.stem for plot in plots(runs)]
    assert not [stem for stem in stems if 'error' in stem]
    assert {'q_tot_before_after', 'overlap_over_time', 'second_difference_m_over_time'} <= {*stems}


def test_the_same_runs_give_the_same_bytes(tmp_path):
    runs = read_runs([write_replayed(tmp_path)])
    first, second = next(plots(runs)), next(plots(runs))
    assert (first.svg, first.png) == (second.svg, second.png)


@pytest.mark.parametrize('value', [0.0, -1.0, 1e-300, 1e99, None])
def test_any_number_in_every_frame_can_be_drawn(tmp_path, few_measures, value):
    def change(record):
        for frame in record['frames']:
            frame.update({name: value for name in frame if 'q_' in name})
            size = value and abs(value)  # an error is no less than zero
            frame.update({name: size for name in frame if 'error' in name})

    runs = read_runs([changed(write_replayed(tmp_path), change)])
    stems = [plot.stem for plot in plots(runs)]
    assert ('translation_error_m_cumulative' in stems) == (value is not None)


def test_a_run_without_frames_is_drawn_beside_one_with_some(tmp_path, few_measures):
    result = write_replayed(tmp_path)
    runs = read_runs([result, changed(result, lambda record: record.update(frames=[]))])
    assert len(list(plots(runs))) == 7
    assert list(plots(runs[1:])) == []


def test_an_axis_is_logarithmic_only_over_a_range_that_is_worth_it():
    assert scaled([1e-3, 1.0])[0]
    assert not scaled([1.0, 2.0])[0]
    assert not scaled([0.0, 0.0])[0]
    assert not scaled([1e-3, 1.0], log=False)[0]


@pytest.mark.parametrize('values', [[1e-3, 1], [0.4, 2.2], [4.0, 4.1], [7, 7], [-3, 9], [1e-9, 9]])
def test_an_axis_holds_all_values_and_few_ticks(values):
    _, axes = scaled(values)
    low, high = axes.get_xlim()
    positive = [value for value in values if value > 0 or axes.get_xscale() == 'linear']
    assert low < min(positive)
    assert max(values) < high
    assert 2 <= len([tick for tick in axes.get_xticks() if low <= tick <= high]) <= 7


def test_a_name_in_a_legend_is_short_and_no_formula():
    assert shown('a$b$') == r'a\$b\$'
    assert shown('a\nb') == 'a?b'
    assert len(shown('x' * 300)) <= 26
    assert shown('abc' * 20 + 'end').endswith('end')
