"""The numbers that registrations were tuned by: each with its reason, and where it was measured.

`python -m benchmarks ablate` sets each to its neutral value in turn, on cases that none was
chosen by. What is no matter of tuning stays with its code: definitions and factors of equations,
limits of what numbers can hold, sizes of samples, and what costs time or memory alone.
"""

from dataclasses import dataclass, field
from math import inf
from typing import Any


def tuned(
    value: float, neutral: float, measured: str, reason: str, acts_on_auto: bool = False
) -> Any:
    """Return the field of a number.

    Args:
        value: its value.
        neutral: what leaves it out.
        measured: the benchmarks that it was chosen by.
        reason: what it is, and why it is as it is.
        acts_on_auto: whether it acts where the voxel size is found, and not where it is given.
    """
    of = {'neutral': neutral, 'measured': measured, 'reason': reason}
    return field(default=value, metadata={**of, 'acts_on_auto': acts_on_auto})


@dataclass(frozen=True)
class SolverTuning:
    """What the solver's stages go by; lengths are multiples of a stage's radius."""

    apart: float = tuned(
        0.35,
        inf,
        'accuracy: street, forest',
        'among voxels, the distance of the two means of a ball that halves its weight in the last '
        'stage: farther apart they are two rings of a LiDAR, or two sides of a rim',
    )
    voxel_radius: float = tuned(
        0.8,
        1.0,
        'accuracy: street',
        'of the last radius among voxels: their scatter tells a surface in a narrower ball, which '
        'averages less curvature away',
    )
    spacing: float = tuned(
        0.6,
        0.3,
        'speed, accuracy',
        'least edge of the voxels of a coarse stage: some ten to a ball, whatever the cloud, '
        'bound its time',
    )
    ease: float = tuned(
        50.0,
        1.0,
        'speed',
        'of the tolerances in the stages before the last, which need only reach the basin of the '
        'next one: saves time',
    )
    widest: float = tuned(
        0.75,
        inf,
        'accuracy: far starts',
        "of half the diagonal of the smaller cloud's box: the radius of the widest stage; a wider "
        'ball holds all of the cloud, and tells no part of it from another',
    )
    noise_ratio: float = tuned(
        250.0,
        0.0,
        'accuracy: noise',
        'r sqrt(k) over the thickness of surfaces up to which the last radius is widened: the '
        'means of k points of a surface of thickness s are known to s / sqrt(k), and a ball that '
        "is not wide against that tells the surface's direction badly; wider gained nothing",
    )
    most_widening: float = tuned(
        2.0,
        1.0,
        'accuracy: noise',
        'of the last radius, for noise: twice it halves the error in a room at 9 standard '
        'deviations of noise, and doubles it in a street at 50',
    )
    spread_gap: float = tuned(
        0.03,
        inf,
        'accuracy: similar, density',
        'of the radius squared: by how much the spreads of two samplings about their own points '
        'differ at most, if their curvatures make up for each other; samplings at random differ '
        'by 0.01, from even ones by 0.08',
    )
    curvature: float = tuned(
        2.0,
        1.0,
        'accuracy: similar, overlap 50 %',
        'most that the mean of own points in a ball is moved by for the curvature of its surface, '
        'times what it lies from the tangent; of points as given whose samplings differ',
    )
    most_relaxation: float = tuned(
        4.0,
        2.0,
        'speed, accuracy',
        "of any step, by Aitken's secant; 2 is as far as the majoriser itself goes",
    )
    patience: float = tuned(
        15,
        inf,
        'accuracy: points as given',
        'steps after which moves of a stage may only grow shorter: the cost jumps where a member '
        'enters or leaves a ball, and a minimum at such a jump is circled, not reached',
    )
    wider: float = tuned(
        2.0,
        1.0,
        'accuracy: far starts',
        'of the first stage, for another try where the first ended in no valley of q_tot: far '
        'guesses',
    )
    valley: float = tuned(
        0.5,
        0.0,
        'accuracy: far starts',
        'confidence in the valley that the first stage ended in, up to which a wider one is tried',
    )
    sure: float = tuned(
        0.9,
        1.0,
        'speed, accuracy',
        "confidence in a coarse stage's valley from which on one of the next stages is left out: "
        'saves time',
    )
    nowhere: float = tuned(
        0.02,
        0.0,
        'bounded, tunnels',
        'confidence in the valley that the coarse stages ended in, below which no motion is gone '
        'through again as guessed: of garbage it is 0.003 and less, of scans, be they of bare '
        'tunnels, 0.12 and more',
    )
    weak: float = tuned(
        0.06,
        0.0,
        'tunnels',
        'strength of a direction (mean square along the normals) below which the pattern of the '
        'sensor may be what determines it: a pattern leaves up to 0.05, towns 0.1 and more',
    )
    gentle: float = tuned(
        0.0005,
        inf,
        'tunnels',
        'strength that surfaces which are not across a direction must have to determine it alone: '
        'the hills of a plain; bare scenes have half of it at most',
    )
    gentle_share: float = tuned(
        0.15,
        1.0,
        'tunnels',
        'of the whole strength, likewise: plains have 0.2 and more, where a few surfaces hold 0.1',
    )
    no_lines: float = tuned(
        0.9,
        0.0,
        'tunnels',
        'share of the balls that hold surfaces, above which lines are too few to be a pattern',
    )
    reach: float = tuned(
        2.0,
        inf,
        'tunnels',
        'of the first radius: a guess is not taken to be farther off along a weak direction',
    )
    settled: float = tuned(
        0.5,
        inf,
        'tunnels',
        'how far the last stage may go on along a weak direction from where surfaces coincide',
    )
    pattern_votes: float = tuned(
        6.0,
        inf,
        'tunnels',
        "votes of the sensor's pattern over those of the surfaces, from which on it rules: 10 to "
        '30 where rings coincide, up to 3 elsewhere',
    )
    pattern_near: float = tuned(
        0.3,
        0.0,
        'tunnels',
        "how near a way must be to one that the pattern votes for to be the pattern's: rings and "
        'columns coincide in many places',
    )
    pattern_rise: float = tuned(
        0.5,
        0.0,
        'tunnels',
        "of what the pattern's votes rise by at most: how much they rise there",
    )
    more_votes: float = tuned(
        1.05,
        1.0,
        'sweeps, tunnels',
        'of the votes so far, that another motion of the sweep must have: of one niche in sight '
        'any speed has nearly as many',
    )
    most_voxels: float = tuned(
        10_000,
        inf,
        'voxels, speed',
        'that the cloud of fewer fills, of several the median one, at the size that is found: '
        'what is finer costs more than it gains',
        acts_on_auto=True,
    )
    least_voxels: float = tuned(
        2_000,
        1,
        'voxels',
        'that a cloud fills at the coarsest size: fewer lose the scene; of small clouds half of '
        'their points',
        acts_on_auto=True,
    )
    most_thickness: float = tuned(
        0.055,
        inf,
        'voxels',
        "of voxels' edges, the flattest quarter of the surfaces: noise fills finer voxels; it is "
        'alike in neighbouring pixels of a depth camera, so that their number does not help',
        acts_on_auto=True,
    )
    least_surfaces: float = tuned(
        0.52,
        0.0,
        'voxels',
        'share of the balls of many points that hold surfaces, not lines as rings of a LiDAR: '
        'finer voxels are of no use',
        acts_on_auto=True,
    )
    least_sure: float = tuned(
        0.15,
        0.0,
        'voxels',
        'share of the balls of many points, where there are none of those of few, whose surface a '
        'ball twice as wide holds, too, and is no fan of a ring that noise spreads: 0.1 at most '
        'where rings lie apart, 0.28 and more at sizes that suit real scans',
        acts_on_auto=True,
    )
    few_points: float = tuned(
        4_000,
        1,
        'voxels',
        'of both clouds, up to which they are taken as given',
        acts_on_auto=True,
    )


SOLVER = SolverTuning()
