"""What an ablation tells, as Markdown: each number's worth, and where it is beyond chance."""

from itertools import chain

import numpy as np

from benchmarks.ablate_cases import STARTS
from benchmarks.chance import ratio_interval
from idem_ros.terminal.markdown import number as digits
from idem_ros.terminal.markdown import table

ERRORS = {'rotation': 50, 'rotation p90': 90, 'translation': 50, 'translation p90': 90}
HEADER = (
    *('number', 'tuned', 'neutral', 'pairs', 'changed', 'right only with / without it'),
    'aligned but wrong',
    *(f'{name} without / with' for name in ERRORS),
    'time',
)
TRUST = (
    *('number', 'tuned', 'neutral', 'pairs', 'aligned and right', 'aligned but wrong'),
    *('right, not aligned', 'squared error over covariance'),
)
NOTE = """Each number is set to its neutral value in turn, on cases that none was chosen by: new
real scans, simulated scenes and samplings of other seeds and of other bodies. Registrations lost
and gained are of all starts. Ratios are of the median or 90th percentile over the near starts that
end right both ways (others of a pair end in the same minimum), translations in spacings of their
own cases; in brackets what holds 95 % of 2 000 paired resamplings. A number whose brackets hold 1
everywhere, and that saves no registration and no time, is not worth its line.
"""
NEAR = next(iter(STARTS))
TELLING = 0.01  # of a ratio: what is nearer to 1 is no difference, however sure


def ablation_markdown(chosen, compared, trials=None):
    """Return the tables of `Compared` runs.

    Args:
        chosen: the `Number`s.
        compared: of `ablate`.
        trials: cases of each kind at most; None: all that there are.
    """
    of = {each.name: [c for c in compared if c.number == each.name] for each in chosen}
    solver = [_row(each, of[each.name]) for each in chosen if each.of == 'tuning']
    trust = [_trust_row(each, of[each.name]) for each in chosen if each.of == 'trust']
    few = f'\nOf each kind of case {trials} are drawn.\n' if trials else ''
    parts = ['## Ablation\n', NOTE + few]
    if solver:
        parts += [table(HEADER, solver), '### Beyond chance, by kind of case\n']
        lines = [_beyond(each, of[each.name]) for each in chosen if each.of == 'tuning']
        parts.append(''.join(chain(*lines)) or 'Nothing.\n')
    if trust:
        parts += ['### Verdict and covariance\n', table(TRUST, trust)]
    return '\n'.join(parts)


def _pairs(compared):
    return [pair for each in compared for pair in zip(each.tuned, each.neutral, strict=True)]


def _row(number, compared):
    pairs = _pairs(compared)
    changed = sum(_differ(*pair) for pair in pairs)
    lost = sum(a.right and not b.right for a, b in pairs)
    gained = sum(b.right and not a.right for a, b in pairs)
    time = sum(b.ms for _, b in pairs) / sum(a.ms for a, _ in pairs)
    near = _pairs(each for each in compared if each.level == NEAR)
    ratios = (_told(_ratio(near, name)) for name in ERRORS)
    return (
        *(number.name, f'{number.value:g}', f'{number.neutral:g}', len(pairs), changed),
        *(f'{lost} / {gained}', _alarms(pairs), *ratios, f'{time:.2f}'),
    )


def _alarms(pairs):
    """Return how many are called aligned but are wrong, with a number and without it."""
    sides = zip(*pairs, strict=True)
    return ' → '.join(str(sum(run.aligned and not run.right for run in side)) for side in sides)


def _differ(a, b):
    return (a.rotation, a.translation) != (b.rotation, b.translation)


def _ratio(pairs, name):
    """Return the ratio of an error without a number to that with it, and its interval."""
    what, percent = name.split()[0], ERRORS[name]
    right = [(a, b) for a, b in pairs if a.right and b.right]
    if len(right) < 2:
        return None
    errors = np.array([[getattr(run, what) for run in side] for side in zip(*right, strict=True)])
    with_it, without = np.percentile(errors, percent, axis=1)
    if np.array_equal(*errors):
        return 1.0, 1.0, 1.0
    return without / with_it, *ratio_interval(errors[1], errors[0], percent)


def _told(ratio):
    if ratio is None:
        return '-'
    return f'{ratio[0]:.2f} [{ratio[1]:.2f}, {ratio[2]:.2f}]'


def _beyond(number, compared):
    """Yield a line for each kind of case and error in which a number tells beyond chance."""
    for group in dict.fromkeys(each.group for each in compared):
        of_group = [each for each in compared if each.group == group]
        pairs = _pairs(of_group)
        near = _pairs(each for each in of_group if each.level == NEAR)
        lost = sum(a.right and not b.right for a, b in pairs)
        gained = sum(b.right and not a.right for a, b in pairs)
        told = [f'right only with it {lost}, only without {gained}'] if lost + gained else []
        alarms = _alarms(pairs)
        if len(set(alarms.split(' → '))) > 1:
            told.append(f'aligned but wrong {alarms}')
        for name in ERRORS:
            ratio = _ratio(near, name)
            if ratio and (ratio[1] > 1.0 + TELLING or ratio[2] < 1.0 - TELLING):
                told.append(f'{name} {_told(ratio)}')
        if told:
            yield f'- {number.name}, {group} ({len(pairs)}): {"; ".join(told)}\n'


def _trust_row(number, compared):
    pairs = _pairs(compared)
    sides = [list(side) for side in zip(*pairs, strict=True)]
    counts = (
        [sum(run.aligned and run.right for run in side) for side in sides],
        [sum(run.aligned and not run.right for run in side) for side in sides],
        [sum(run.right and not run.aligned for run in side) for side in sides],
    )
    surprise = [_mean_surprise(side) for side in sides]
    return (
        *(number.name, f'{number.value:g}', f'{number.neutral:g}', len(pairs)),
        *(f'{a} → {b}' for a, b in counts),
        f'{digits(surprise[0])} → {digits(surprise[1])}',
    )


def _mean_surprise(runs):
    known = [
        run.surprise for run in runs if run.right and run.aligned and run.surprise is not None
    ]
    return float(np.mean(known)) if known else None
