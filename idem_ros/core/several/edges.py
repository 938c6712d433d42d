"""The overlap graph of clouds at their poses: each pair judged, and each cloud by these."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from idem_ros.core.arrays import Mask, Transform, Transforms
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.cloud import Cloud
from idem_ros.core.metric.voxel_size import size_found
from idem_ros.core.registration import registered
from idem_ros.core.several.joint_agreement import JointAgreement
from idem_ros.core.several.joint_result import USABLE, CloudVerdict, Edge
from idem_ros.core.several.system import parts_of
from idem_ros.core.solve.sweep import sweep_of
from idem_ros.core.status import Status
from idem_ros.core.trust.prior import Guess, information_of_guess
from idem_ros.core.trust.reasons import WIDER
from idem_ros.core.trust.verdict import Assessment, Verdict
from idem_ros.core.trust_tuning import TrustTuning
from idem_ros.core.tuning import SOLVER
from idem_ros.core.workers import OutOfTime, Workers, in_threads


class Audit(NamedTuple):
    """How pairs are audited where the poses put them."""

    poses: Transforms  # (K, 4, 4) of the clouds' frames
    config: RegistrationConfig  # whose voxel size is known
    trust: TrustTuning
    workers: Workers

    def of(self, target: Cloud, source: Cloud, T_target_source: Transform) -> Assessment:
        """Return what is to be thought of a pose.

        Raises:
            OutOfTime: the workers are late.
        """
        config = replace(self.config, mode='audit', assessment='verdict', threads=1)
        guess = Guess(T_target_source, information_of_guess(None, config))
        workers = self.workers._replace(threads=1)
        sweep = sweep_of(source, None, config)
        both = workers, workers
        result = registered(target, sweep, guess, config, SOLVER, self.trust, both)
        if result.status is Status.LATE:
            raise OutOfTime
        assert result.assessment is not None, 'it was asked for'
        return result.assessment


def edges_of(agreement: JointAgreement) -> list[Edge]:
    """Return the `Edge`s of clouds that meet, not yet judged."""
    met = agreement.met + agreement.met.T
    return [
        Edge(int(i), int(j), agreement.overlap(i, j), agreement.q_mean(i, j))
        for i, j in np.argwhere(np.triu(met, 1) > 0.0)
    ]


def judged(edges: Sequence[Edge], clouds: Sequence[Cloud], audit: Audit) -> list[Edge]:
    """Return the `Edge`s with a verdict: each pair alone is audited where the poses put it.

    Raises:
        OutOfTime: the workers are late.
    """

    def judge(edge: Edge) -> Edge:
        """Return one with its verdict."""
        if edge.overlap < audit.trust.least_overlap:
            share = f'{edge.overlap:.1%} of the points have a neighbour in the other cloud'
            return replace(edge, verdict=Verdict.LOW_OVERLAP, reason=share)
        T = se3.inverse(audit.poses[edge.i]) @ audit.poses[edge.j]
        assessment = audit.of(clouds[edge.i], clouds[edge.j], T)
        return replace(edge, **judged_as(assessment))

    return in_threads(audit.workers, judge, edges)


def judged_as(assessment: Assessment) -> dict[str, Any]:
    """Return an `Assessment` of two clouds as the fields of their `Edge`."""
    is_usable = assessment.verdict in USABLE
    return {
        'verdict': assessment.verdict,
        'p_aligned': assessment.p_aligned,
        'reason': assessment.reason,
        'covariance': assessment.covariance if is_usable else None,
        'gap': assessment.offset,
    }


def turned_around(edge: Edge, T_i_j: Transform) -> Edge:
    """Return an `Edge` with i and j exchanged; T_i_j: (4, 4), j's pose in i."""
    R, t = T_i_j[:3, :3], T_i_j[:3, 3]
    change = np.zeros((6, 6))
    change[:3, :3] = change[3:, 3:] = -R.T
    change[:3, 3:] = -R.T @ se3.skew(t)
    covariance, gap = edge.covariance, edge.gap
    return replace(
        edge,
        i=edge.j,
        j=edge.i,
        covariance=None if covariance is None else change @ covariance @ change.T,
        gap=None if gap is None else change @ gap,
    )


def verdicts_of(
    edges: Sequence[Edge], clouds: Sequence[Cloud], fixed: Mask, radius: float, audit: Audit
) -> list[CloudVerdict]:
    """Return what is to be thought of each cloud: it is audited against those that it meets.

    Against the union of those that it is aligned with one by one, or of all where there are none:
    one that is misplaced spoils no other.

    Raises:
        OutOfTime: the workers are late.
    """
    company, size = [_company(edges, k) for k in range(len(clouds))], size_found(audit.config)
    reduced = clouds if size is None else [cloud.reduced(size) for cloud in clouds]

    def judge(k: int) -> CloudVerdict:
        """Return one's verdict."""
        if not company[k]:
            return CloudVerdict(Verdict.SEPARATED, 0.0, _apart(clouds, k, radius))
        others = company[k]
        union = Cloud.joined([reduced[j] for j in others], audit.poses[others])
        assessment = audit.of(union, clouds[k], audit.poses[k])
        return CloudVerdict(assessment.verdict, assessment.p_aligned, assessment.reason)

    verdicts = in_threads(audit.workers, judge, range(len(clouds)))
    return _led_to(verdicts, company, fixed)


def _company(edges: Sequence[Edge], k: int) -> list[int]:
    own = [edge for edge in edges if k in (edge.i, edge.j)]
    good = [edge for edge in own if edge.verdict in USABLE]
    return [edge.j if edge.i == k else edge.i for edge in good or own]


def _led_to(
    verdicts: list[CloudVerdict], company: Sequence[Sequence[int]], fixed: Mask
) -> list[CloudVerdict]:
    """Return verdicts, but for clouds that agree with others, of which none leads to one held."""
    good = [assessment.verdict in USABLE for assessment in verdicts]
    links = [(k, j) for k, is_good in enumerate(good) if is_good for j in company[k]]
    part = parts_of(np.array(links, int).reshape(-1, 2), len(verdicts))
    for k, is_good in enumerate(good):
        if not is_good or fixed[part == part[k]].any():
            continue
        reason = 'it agrees with clouds that agree with none of those that lead to one held'
        verdicts[k] = CloudVerdict(Verdict.MISALIGNED, verdicts[k].p_aligned, reason)
    return verdicts


def _apart(clouds: Sequence[Cloud], k: int, radius: float) -> str:
    """Return why no point of a cloud meets another, and what to look at."""
    widths = [float(np.ptp(cloud.extent(), axis=0).max()) for cloud in clouds]
    usual, own = float(np.median(widths)), widths[k]
    reason = f'no point has a neighbour in another cloud within {radius:.3g}'
    if max(own, usual) > WIDER * min(own, usual):
        return f'{reason}; it is {own:.3g} wide, the others {usual:.3g}: the same unit?'
    return f'{reason}: is its pose right?'
