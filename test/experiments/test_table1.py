import pytest

from idem_ros.experiments.experiment import Context
from idem_ros.experiments.models import paper_model
from idem_ros.experiments.table1 import FACTOR, PAPER, run, sensitivity

TRIALS = 24


@pytest.fixture(scope='module')
def rows():
    model = paper_model()
    return [sensitivity(model, row.sigma, TRIALS) for row in PAPER]


@pytest.mark.parametrize('number', range(len(PAPER)), ids=[f'sigma {r.sigma}' for r in PAPER])
def test_the_mean_is_within_a_factor_of_the_papers(rows, number):
    ours, paper = rows[number], PAPER[number]
    assert 1 / FACTOR < ours.mean / paper.mean < FACTOR
    assert 0 < ours.deviation < 3 * paper.deviation


def test_means_grow_and_the_variation_falls_with_the_noise(rows):
    means = [row.mean for row in rows]
    assert means == sorted(means)
    assert rows[0].variation > 2 * rows[-1].variation


def test_threads_do_not_change_a_row():
    model = paper_model()
    one, two = (sensitivity(model, 0.05, 4, threads=threads) for threads in (1, 2))
    assert one == two


def test_the_page_puts_the_papers_figures_beside_ours(tmp_path, monkeypatch):
    pytest.importorskip('matplotlib')
    monkeypatch.setattr('idem_ros.experiments.table1.QUICK_TRIALS', 3)
    paths = run(Context(tmp_path, paper_model(), quick=True))
    page = paths[-1].read_text()
    assert all(f'{row.mean:.2f}' in page for row in PAPER)
    assert (tmp_path / 'figure19.pdf').stat().st_size > 1000
