"""Which sources a node keeps for later, and where: the parameters of its capsules."""

from dataclasses import dataclass

from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import parameter, require_fields

NOT_ALIGNED, REFUSED, LATE, ALL = WHEN = ('not_aligned', 'refused', 'late', 'all')


@dataclass(frozen=True)
class CapsuleConfig:
    """When a source is written to disk with all that it was refined from."""

    folder: str = parameter(
        '',
        'folder for capsules: recordings of one source each, with target, guess, result, '
        'parameters and the last ten diagnostics, for `idem show` and `idem replay`; it is made '
        'where its parent exists; empty: none are written',
        name='capsules.folder',
    )
    when: str = parameter(
        NOT_ALIGNED,
        'of which sources: "not_aligned" (whose verdict is another, and refused ones), "refused", '
        '"late" (that ran out of budget_ms) or "all"',
        name='capsules.when',
        choices=WHEN,
    )
    most: int = parameter(
        100, 'capsules that are kept; the oldest goes first', name='capsules.most'
    )
    most_mb: int = parameter(
        1000, 'that they may hold together; the oldest goes first', 'MB', name='capsules.most_mb'
    )

    def __post_init__(self):
        require_fields(self)
        if '\0' in self.folder:
            raise InvalidConfig(f'capsules.folder is {self.folder!r}; it must name a folder')
