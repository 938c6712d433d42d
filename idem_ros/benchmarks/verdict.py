"""The figures to reach, held against what was measured."""

from dataclasses import dataclass

from idem_ros.benchmarks.case import LEVELS
from idem_ros.benchmarks.methods import IDEM

ERRORS = {'rotation_deg': ('rotation', 'deg', 1.0), 'translation_m': ('translation', 'mm', 1e3)}

UNDECIDED = 'undecided'


@dataclass(frozen=True)
class Verdict:
    """One figure: in how many rows it is reached, and where it is not, with both numbers.

    Attributes:
        figure: what is to be reached.
        reached: in how many rows it is.
        rows: of how many.
        undecided: in how many of the reached a peer has the smaller number, and both lie within
            what the truth is uncertain by.
        missed: a line for each of the others.
    """

    figure: str
    reached: int
    rows: int
    undecided: int
    missed: tuple

    def __str__(self):
        line = f'{"reached" if not self.missed else "MISSED"}: {self.figure}: '
        line += f'{self.reached} of {self.rows} rows'
        if self.undecided:
            line += f", in {self.undecided} of them a peer's is smaller but"
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
    """judge(result, IDEM's figures, the peers') -> None, UNDECIDED or what is missed."""
    judged = []
    for result in results:
        idem, *peers = result.levels[level]
        assert idem.method == IDEM
        judged.append((result.name, judge(result, idem, peers)))
    missed = tuple(f'{name}: {said}' for name, said in judged if said not in (None, UNDECIDED))
    undecided = sum(said == UNDECIDED for _, said in judged)
    return Verdict(figure, len(results) - len(missed), len(results), undecided, missed)


def _error(key, part):
    _, unit, scale = ERRORS[key]

    def judge(result, idem, peers):
        ours = _or_infinite(getattr(idem, key)[part])
        best = min(peers, key=lambda peer: _or_infinite(getattr(peer, key)[part]))
        theirs = _or_infinite(getattr(best, key)[part])
        if ours <= theirs:
            return None
        if ours <= getattr(result, f'truth_{key}'):
            return UNDECIDED
        return f'{scale * ours:.3g} {unit}, {best.method} {scale * theirs:.3g} {unit}'

    return judge


def _success(_, idem, peers):
    best = max(peers, key=lambda peer: peer.success)
    if idem.success >= best.success:
        return None
    return f'{idem.success:.0%}, {best.method} {best.success:.0%}'


def _or_infinite(value):
    return float('inf') if value is None else value
