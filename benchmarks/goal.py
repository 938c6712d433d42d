"""A number held against the figure to reach."""

from dataclasses import asdict, dataclass

from idem_ros.terminal.markdown import table


@dataclass(frozen=True)
class Goal:
    """What was measured and what it may be at most; `measured` is None where nothing was."""

    figure: str
    measured: float | None
    at_most: float
    unit: str = ''

    @property
    def reached(self):
        """Whether the figure is reached."""
        return self.measured is not None and bool(self.measured <= self.at_most)

    def cells(self):
        """Return the figure as a row of the table of `goals_table`."""
        measured = '-' if self.measured is None else f'{self.measured:.3g}'
        unit = f' {self.unit}' if self.unit else ''
        verdict = 'reached' if self.reached else 'MISSED'
        return self.figure, f'{measured}{unit}', f'{self.at_most:g}{unit}', verdict

    def record(self):
        """Return the figure as what JSON holds."""
        return {**asdict(self), 'reached': self.reached}


def goals_table(goals):
    """Return `Goal`s as a Markdown table."""
    return table(('figure', 'measured', 'at most', ''), [goal.cells() for goal in goals])
