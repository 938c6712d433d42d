"""The figures to reach, held against what was measured."""

from dataclasses import dataclass

from benchmarks.case import LEVELS
from benchmarks.chance import ratio_interval
from benchmarks.methods import IDEM

ERRORS = {'rotation_deg': ('rotation', 'deg', 1.0), 'translation_m': ('translation', 'mm', 1e3)}

PERCENT = {'median': 50, 'p90': 90}
SAID = REACHED, CLEARLY, UNDECIDED = 'reached', 'clearly', 'undecided'


@dataclass(frozen=True)
class Verdict:
    """One figure: in how many rows it is reached, and where it is not, with both numbers.

    Attributes:
        figure: what is to be reached.
        reached: in how many rows it is.
        rows: of how many.
        clearly: in how many of the reached other cases, drawn from these, would hardly say
            otherwise: see `ratio_interval`.
        undecided: in how many of the reached a peer has the smaller number, and both lie within
            what the truth is uncertain by.
        missed: a line for each of the others.
    """

    figure: str
    reached: int
    rows: int
    clearly: int
    undecided: int
    missed: tuple

    def __str__(self):
        line = f'{"reached" if not self.missed else "MISSED"}: {self.figure}: '
        line += f'{self.reached} of {self.rows} rows'
        if self.clearly:
            line += f', in {self.clearly} of them beyond chance'
        if self.undecided:
            line += f", in {self.undecided} a peer's is smaller but"
            line += ' the truth too uncertain to tell'
        return line + ''.join(f'\n    {miss}' for miss in self.missed)


def verdicts(results):
    """Return the `Verdict`s on `RowResult`s: errors at the first level, success at every level."""
    found = [
        _judged(
            f"{part} of the {word} error at most the best peer's", results, 0, _error(key, part)
        )
        for key, (word, _, _) in ERRORS.items()
        for part in ('median', 'p90')
    ]
    for level, (multiple, degrees) in enumerate(LEVELS):
        figure = f"success from {multiple} r4th, {degrees:g} deg at least the best peer's"
        found.append(_judged(figure, results, level, _success))
    return found


def _judged(figure, results, level, judge):
    """judge(result, IDEM's figures, the peers') -> one of `SAID`, or what is missed."""
    judged = []
    for result in results:
        idem, *peers = result.levels[level]
        assert idem.method == IDEM
        judged.append(judge(result, idem, peers))
    missed = tuple(
        f'{result.name}: {miss}'
        for result, miss in zip(results, judged, strict=True)
        if miss not in SAID
    )
    rows = len(results)
    clearly, undecided = judged.count(CLEARLY), judged.count(UNDECIDED)
    return Verdict(figure, rows - len(missed), rows, clearly, undecided, missed)


def _error(key, part):
    _, unit, scale = ERRORS[key]

    def judge(result, idem, peers):
        ours = _or_infinite(getattr(idem, key)[part])
        best = min(peers, key=lambda peer: _or_infinite(getattr(peer, key)[part]))
        theirs = _or_infinite(getattr(best, key)[part])
        by_chance = _interval(result, idem, best, key, part)
        if ours <= theirs:
            return CLEARLY if by_chance and by_chance[1] < 1.0 else REACHED
        if ours <= getattr(result, f'truth_{key}'):
            return UNDECIDED
        miss = f'{scale * ours:.3g} {unit}, {best.method} {scale * theirs:.3g} {unit}'
        if by_chance:
            low, high = by_chance
            miss += f'; by chance {low:.2f} to {high:.2f} times that'
        return miss

    return judge


def _interval(result, idem, peer, key, part):
    """Return what chance makes of the ratio; None: all runs were in one case, with one answer."""
    if result.kind == 'real':
        return None
    each = (getattr(method, f'each_{key}') for method in (idem, peer))
    return ratio_interval(*each, PERCENT[part])


def _success(_, idem, peers):
    best = max(peers, key=lambda peer: peer.success)
    if idem.success >= best.success:
        return REACHED
    return f'{idem.success:.0%}, {best.method} {best.success:.0%}'


def _or_infinite(value):
    return float('inf') if value is None else value
