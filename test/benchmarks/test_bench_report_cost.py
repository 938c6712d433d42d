import json

import pytest
from replayed import write_replayed

from benchmarks.commands.main import main
from benchmarks.goal import Goal
from benchmarks.report_cost import measure, repeated
from idem_ros.report import plots as report_plots


def test_a_generated_result_has_as_many_frames_and_its_own_are_the_worst(tmp_path):
    record = json.loads(write_replayed(tmp_path).read_text())
    frames = repeated(record, 11)['frames']
    assert len({frame['stamp_ns'] for frame in frames}) == len(frames) == 11
    errors = [frame['q_mean'] for frame in frames]
    assert min(map(abs, errors[:4])) > max(map(abs, errors[4:]))


def test_time_and_size_are_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(report_plots, 'MEASURES', report_plots.MEASURES[:1])
    write_replayed(tmp_path)
    seconds, megabytes = measure(tmp_path / 'scans.mcap', frames=5)
    assert (seconds.unit, megabytes.unit) == ('s', 'MB')
    assert seconds.measured > 0
    assert 0.1 < megabytes.measured < 10
    assert seconds.figure == 'report of 5 frames, 4 of them drawn'


@pytest.mark.parametrize(('seconds', 'code'), [(29.0, 0), (31.0, 1)])
def test_a_missed_figure_ends_with_exit_code_1(monkeypatch, tmp_path, capsys, seconds, code):
    asked = []

    def measured(bag, frames):
        asked.append((bag.name, frames))
        return [Goal('report', seconds, 30.0, 's')]

    monkeypatch.setattr('benchmarks.report_cost.measure', measured)
    out = tmp_path / 'report.json'
    assert main(['report', '--quick', '--json', str(out)]) == code
    assert asked == [('demo.mcap', 100)]
    assert json.loads(out.read_text())['goals'][0]['measured'] == seconds
