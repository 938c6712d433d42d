"""The numbers that the solver was tuned by, each with its reason and where it was measured.

`python -m benchmarks ablate` sets each to its neutral value in turn, on cases that none was
chosen by.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any


def _tuned(value: float, reason: str, neutral: float) -> Any:
    return field(default=value, metadata={'reason': reason, 'neutral': neutral})


@dataclass(frozen=True)
class SolverTuning:
    """What the solver's stages go by; lengths are multiples of a stage's radius."""

    noise: float = _tuned(
        0.005,
        'standard deviation added to every axis of a covariance, so that an exact plane has an '
        'inverse; on real scans any value up to this one gives the same',
        1e-4,
    )
    apart: float = _tuned(
        0.35,
        'among voxels, the distance of the two means of a ball that halves its weight in the last '
        'stage: farther apart they are two rings of a LiDAR, or two sides of a rim',
        float('inf'),
    )
    voxel_radius: float = _tuned(
        0.8,
        'of the last radius among voxels: their scatter tells a surface in a narrower ball, which '
        'averages less curvature away',
        1.0,
    )
    spacing: float = _tuned(
        0.6,
        'least edge of the voxels of a coarse stage: some ten to a ball, whatever the cloud, '
        'bound its time',
        0.3,
    )
    ease: float = _tuned(
        50.0,
        'of the tolerances in the stages before the last, which need only reach the basin of the '
        'next one: saves time',
        1.0,
    )
    crowded: float = _tuned(
        60.0,
        'points that share a cell of the last radius, on average; scans have up to 7. From then '
        'on voxels of a quarter of it are as good, and bound the time of copies and of garbage',
        float('inf'),
    )
    wider: float = _tuned(
        2.0,
        'of the first stage, for another try where the first ended in no valley of q_tot: far '
        'guesses',
        1.0,
    )
    sure: float = _tuned(
        0.9,
        "confidence in a coarse stage's valley from which on one of the next stages is left out: "
        'saves time',
        1.0,
    )


@dataclass(frozen=True)
class TrustTuning:
    """What results are judged by."""

    least_overlap: float = _tuned(
        0.05, 'share of the points that meet, below which a verdict speaks of too little', 0.0
    )
    least_meeting: float = _tuned(
        100, 'points of a cloud that meet: fewer agree at many poses, by chance', 0
    )
    alike: float = _tuned(
        1.25,
        'of every variance of several clouds, and of a motion that is solved: regions farther '
        'apart than the jackknife takes err alike, too, as the rings of both scans do wherever '
        'they fall',
        1.0,
    )
    alike_surfaces: float = _tuned(
        1.15, 'the same of a pair, whose lines are told apart from its surfaces: `in_common`', 1.0
    )
    in_common: float = _tuned(
        0.2,
        'of the variance of surfaces alone: how far the lines of both scans err alike, see '
        '`_widening`',
        0.0,
    )
    jumps: float = _tuned(
        1.1,
        'of the variance of points as measured, which enter balls and leave them one by one: the '
        'minimum jumps by more than the pulls tell',
        1.0,
    )


def tuned_numbers(tuning: SolverTuning | TrustTuning) -> Iterator[tuple[str, float, str, float]]:
    """Yield (name, value, reason, neutral value) of each number of a `SolverTuning` or alike."""
    for each in fields(tuning):
        yield (
            each.name,
            getattr(tuning, each.name),
            each.metadata['reason'],
            each.metadata['neutral'],
        )
