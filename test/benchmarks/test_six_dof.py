import csv

import numpy as np
import pytest

from benchmarks.six_dof import pages as six_dof
from benchmarks.six_dof.independent import independent_case
from benchmarks.six_dof.runs import starts_within
from idem_ros.experiments.experiment import Context
from idem_ros.experiments.maps import count_in_common
from idem_ros.experiments.models import paper_model


@pytest.fixture(scope='module')
def model():
    return paper_model()


def test_independent_samplings_share_no_point(model):
    for name in ('B0-B0.9', 'B0-Bh25', 'B0p1-B0p2'):
        case = independent_case(name, model)
        assert count_in_common(case) == 0
        assert min(len(case.target), len(case.source)) > 400


def test_starts_lie_within_the_region(rng):
    reach = np.array([[-1.0, 2.0]] * 3 + [[-0.1, 0.2]] * 3)
    starts = starts_within(reach, np.zeros(3), 200, rng)
    moves = np.array([T[:3, 3] for T in starts])
    assert moves.min() >= -1.0 - 1e-9
    assert moves.max() <= 2.0 + 1e-9
    assert moves.max() > 1.5 > -0.5 > moves.min()


def test_both_experiments_succeed_where_points_are_shared_and_where_not(
    tmp_path, model, monkeypatch
):
    pytest.importorskip('matplotlib')
    monkeypatch.setattr(six_dof, 'QUICK_CASES', ('B0-B0.9', 'B0-Bn0.05'))
    monkeypatch.setattr(six_dof, 'QUICK_STARTS', 2)
    experiments = (six_dof.run, 'six_dof', 2), (six_dof.run_independent, 'six_dof_independent', 1)
    for run, name, threads in experiments:
        paths = run(Context(tmp_path, model, quick=True, threads=threads))
        assert [path.name for path in paths] == [
            f'{name}.{e}' for e in ('csv', 'png', 'pdf', 'md')
        ]
        rows = [row for row in csv.DictReader(paths[0].open()) if row['method'] == 'IDEM']
        assert [float(row['success_rate']) for row in rows] == [1.0, 1.0]
        assert all(float(row['rotation_median_deg']) < 0.5 for row in rows)
