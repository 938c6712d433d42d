"""Table 1 and figure 19: how q_tot reacts to Gaussian noise, by Monte Carlo."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from idem_ros.core import Cloud, q_tot, search_radius
from idem_ros.experiments.drawing import canvas
from idem_ros.experiments.experiment import write_csv, write_figure, write_page
from idem_ros.terminal.markdown import table

TRIALS, QUICK_TRIALS = 1000, 60
FACTOR = 1.5  # within which a mean counts as the paper's


class Noise(NamedTuple):
    """A row of the table: q_tot of B_0 with its noisy copies."""

    sigma: float  # [mm]
    mean: float
    deviation: float
    variation: float  # CV: deviation over mean


PAPER = (
    Noise(0.01, 48.83, 5.89, 0.12),
    Noise(0.02, 138.39, 8.80, 0.06),
    Noise(0.05, 464.30, 15.90, 0.03),
    Noise(0.1, 972.78, 26.03, 0.03),
)


def run(context):
    """Write table 1 and figure 19; see `Experiment`."""
    trials = QUICK_TRIALS if context.quick else TRIALS
    rows = [
        sensitivity(context.model, row.sigma, trials, context.seed, context.threads)
        for row in context.progress(PAPER, desc='table1')
    ]
    columns = ('mean_q_tot', 'std_q_tot', 'cv')
    header = ('sigma_noise_mm', *columns, *(f'paper_{name}' for name in columns))
    stem = context.out / 'table1'
    beside = [(*ours, *paper[1:]) for ours, paper in zip(rows, PAPER, strict=True)]
    return [
        write_csv(f'{stem}.csv', header, beside),
        *write_figure(context.out / 'figure19', _figure(rows)),
        write_page(f'{stem}.md', _page(context, rows, trials)),
    ]


def sensitivity(model, sigma, trials, seed=0, threads=1):
    """Return the `Noise` row of B_0 against `trials` copies with every coordinate displaced.

    a = 1, lengths as given [mm], and the radius of each pair (Eq. 9), as in the paper.

    Args:
        model: `Model` in place of B_0.
        sigma: standard deviation of the displacement along each axis [mm].
        trials: how many copies, from 2.
        seed: of the displacements; every sigma has its own.
        threads: that share the trials; the results are the same for any number.
    """
    target = Cloud(model.points)
    target.fourth_neighbor_distance()

    def trial(number):
        rng = np.random.default_rng([seed, number, round(1e6 * sigma)])
        source = Cloud(model.points + rng.normal(0.0, sigma, model.points.shape))
        # A cloud of its own: what it keeps for a radius that no other trial has would pile up.
        radius = search_radius(target, source)
        return q_tot(Cloud(model.points), source, radius=radius, length_scale='none')

    with ThreadPoolExecutor(threads) as pool:
        values = np.array(list(pool.map(trial, range(trials))))
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    return Noise(sigma, mean, deviation, deviation / mean)


def _page(context, rows, trials):
    lines = [
        '# Table 1: sensitivity of q_tot to noise',
        '',
        context.model.note,
        '',
        f'{trials} noisy copies for each sigma (the paper: {TRIALS}), every coordinate displaced '
        'by a Gaussian; q_tot of B_0 with the copy, a = 1, lengths in mm.',
        '',
        table(
            ('sigma [mm]', 'mean', 'paper', 'std', 'paper', 'CV', 'paper', 'mean / paper'),
            [_cells(ours, paper) for ours, paper in zip(rows, PAPER, strict=True)],
            left=0,
        ),
        _verdict(rows),
        '',
        '![figure 19](figure19.png)',
    ]
    return '\n'.join(lines)


def _cells(ours, paper):
    pairs = [
        (f'{ours.mean:.2f}', f'{paper.mean:.2f}'),
        (f'{ours.deviation:.2f}', f'{paper.deviation:.2f}'),
        (f'{ours.variation:.3f}', f'{paper.variation:.2f}'),
    ]
    return (f'{ours.sigma:g}', *sum(pairs, ()), f'{ours.mean / paper.mean:.2f}')


def _verdict(rows):
    ratios = [ours.mean / paper.mean for ours, paper in zip(rows, PAPER, strict=True)]
    within = all(1 / FACTOR <= ratio <= FACTOR for ratio in ratios)
    falling = all(
        one.variation > next_.variation for one, next_ in zip(rows, rows[1:], strict=False)
    )
    return (
        f'Means are {"within" if within else "**not** all within"} a factor of {FACTOR} of the '
        f"paper's ({min(ratios):.2f} to {max(ratios):.2f} times); "
        f'the coefficient of variation {"falls" if falling else "does **not** fall"} throughout.'
    )


def _figure(rows):
    figure, ((axes,),) = canvas(1, 1, 3.6, width=5.0)
    for label, of, style in (('here', rows, 'o-'), ('paper', PAPER, 's--')):
        axes.plot([row.sigma for row in of], [row.deviation for row in of], style, label=label)
    axes.set(xlabel='sigma of the noise [mm]', ylabel='standard deviation of q_tot [nat]')
    axes.set_title('Figure 19: B0 with noisy copies of itself')
    axes.grid(alpha=0.3)
    axes.legend()
    return figure
