"""The numbers that verdicts and covariances were tuned by, as `tuning` has those of the solver."""

from dataclasses import dataclass

from idem_ros.core.tuning import tuned


@dataclass(frozen=True)
class TrustTuning:
    """What results are judged by."""

    least_overlap: float = tuned(
        0.05,
        0.0,
        'trust',
        'share of the points that meet, below which a verdict speaks of too little',
    )
    least_meeting: float = tuned(
        100,
        0,
        'trust',
        'points of a cloud that meet: fewer agree at many poses, by chance',
    )
    alike: float = tuned(
        1.25,
        1.0,
        'trust, several, sweeps',
        'of every variance of several clouds, and of a motion that is solved: regions farther '
        'apart than the jackknife takes err alike, too, as the rings of both scans do wherever '
        'they fall',
    )
    alike_surfaces: float = tuned(
        1.15,
        1.0,
        'trust',
        'the same of a pair, whose lines are told apart from its surfaces: `in_common`',
    )
    in_common: float = tuned(
        0.2,
        0.0,
        'trust',
        'of the variance of surfaces alone: how far the lines of both scans err alike, see '
        '`_widening`',
    )
    jumps: float = tuned(
        1.1,
        1.0,
        'trust',
        'of the variance of points as measured, which enter balls and leave them one by one: the '
        'minimum jumps by more than the pulls tell',
    )


TRUST = TrustTuning()
