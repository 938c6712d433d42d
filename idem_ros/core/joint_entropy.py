"""q_tot of two clouds as a function of the transform between them, and its linearisation."""

from functools import partial

import numpy as np

from idem_ros.core import se3
from idem_ros.core.blocks import in_blocks, in_threads, spans
from idem_ros.core.candidates import SKIN, candidate_pairs, still_hold
from idem_ros.core.cloud import neighbourhoods
from idem_ros.core.linearization import IN_ONE, SUMS, linearize, of_both
from idem_ros.core.moments import TIE, entropy_difference

ALIKE = 0.03  # of the radius squared: samplings at random differ by 0.01, from even ones by 0.08
NOISE = 0.005  # of the radius: standard deviation added to every axis of a covariance


class JointEntropy:
    """The entropy of the joint cloud minus that of its parts, for transforms near one another.

    Transforms are between the frames at the clouds' origins; see `between_origins`.

    Args:
        target, source: `Cloud`s.
        radius: of the balls, > 0, in the clouds' unit.
        length_scale: 'radius' or 'none'.
        threads: for the kernels; the results are the same for any number.
        slide: whether the linearisation leaves out the pull along the surface.
    """

    def __init__(self, target, source, radius, length_scale, threads=1, slide=False):
        self.radius = radius
        self.r2 = radius * radius * TIE
        self.scale = length_unit(length_scale, radius)
        self.noise = (NOISE * radius) ** 2
        self.skin = SKIN * radius
        self.reach = radius * TIE + self.skin
        self.target, self.source = neighbourhoods([target, source], radius, self.scale, threads)
        level = slide and not _are_alike(self.target, self.source, self.r2)
        self.size = (self.r2, self.scale, self.noise, slide, level)
        self.blocks = [
            [np.arange(*span) for span in spans(len(own.order))]
            for own in (self.target, self.source)
        ]
        self.pairs = None
        self.threads = threads

    def per_point(self, T_target_source):
        """Return q_i (Eq. 7) and the other's points in reach, for the target and the source.

        Each a pair of arrays in the order of the cloud's points.
        """
        pairs = self.pairs_at(T_target_source)
        T_source_target = se3.inverse(T_target_source)
        return (
            self._differences(self.target, self.source, pairs.of_target, T_target_source),
            self._differences(self.source, self.target, pairs.of_source, T_source_target),
        )

    def linearize(self, T_target_source):
        """Return gradient (6,) and Gauss-Newton matrix (6, 6) for a twist on the left."""
        pairs = self.pairs_at(T_target_source)
        T_source_target = se3.inverse(T_target_source)
        sides = (
            (self.blocks[0], self.target, self.source, pairs.of_target, T_target_source),
            (self.blocks[1], self.source, self.target, pairs.of_source, T_source_target),
        )
        (here, of_target), (there, of_source) = (self._linearize(*side) for side in sides)
        in_threads(self.threads, lambda block: block(), of_target + of_source)
        (gradient,), (matrix,) = of_both(here, there, T_source_target)
        return gradient, matrix

    def pairs_at(self, T_target_source):
        """Return the `CandidatePairs` near a transform, enumerated again where it has moved."""
        if self.pairs is None or not still_hold(self.pairs, T_target_source, self.skin):
            self.pairs = candidate_pairs(
                self.target.grid, self.source.grid, T_target_source, self.reach, self.threads
            )
        return self.pairs

    def _differences(self, centres, others, candidates, T):
        n = len(centres.order)
        sorted_q, sorted_reach, q, reach = np.empty((4, n))
        own = (centres.grid.points, centres.unit_own, centres.entropy)
        around = (others.grid.points, *candidates, *se3.rotation_and_translation(T))

        def fill(begin, end):
            """Fill q_i and the points in reach of a block of centres."""
            out = (begin, end, sorted_q, sorted_reach)
            entropy_difference(*own, *around, self.r2, self.scale, *out)

        in_blocks(n, self.threads, fill)
        q[centres.order], reach[centres.order] = sorted_q, sorted_reach
        return q, reach

    def _linearize(self, blocks, centres, others, candidates, T):
        """Return sums (blocks, 1, 27) to be filled, and what fills those of each block."""
        own = (centres.grid.points, centres.raw_own)
        around = (others.grid.points, others.raw, *candidates, *se3.rotation_and_translation(T))
        sums = np.zeros((len(blocks), 1, SUMS))
        return sums, [
            partial(linearize, *own, *around, *self.size, block, IN_ONE, of_block)
            for block, of_block in zip(blocks, sums, strict=True)
        ]


def _are_alike(target, source, r2):
    """Whether points are spread about those of their own cloud alike, or stand for raw ones."""
    if len(target.raw) or len(source.raw):
        return True
    spreads = []
    for own in (target.unit_own, source.unit_own):
        own = own[own[:, 0] > 1.0]
        spreads.append(np.mean((own[:, 4] + own[:, 7] + own[:, 9]) / own[:, 0]) if len(own) else 0)
    return bool(abs(spreads[0] - spreads[1]) <= ALIKE * r2)


def length_unit(length_scale, radius):
    """Return what lengths are divided by before an entropy is taken."""
    return radius if length_scale == 'radius' else 1.0


def between_origins(target, source, T_target_source):
    """Return the transform between the frames at the clouds' origins."""
    T = T_target_source.copy()
    T[:3, 3] += T[:3, :3] @ source.origin - target.origin
    return T


def from_origins(target, source, T):
    """Return T_target_source, given the transform between the frames at the clouds' origins."""
    T_target_source = T.copy()
    T_target_source[:3, 3] += target.origin - T[:3, :3] @ source.origin
    return T_target_source
