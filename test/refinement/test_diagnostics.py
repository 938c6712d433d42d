"""What is said of a result, and what may be built upon it."""

import math

import numpy as np
import pytest

from idem_ros.core import RegistrationResult, Status, Verdict
from idem_ros.core.trust.verdict import Assessment
from idem_ros.refinement.diagnostics import ERROR, headline, level, message_of, refinement_values
from idem_ros.refinement.outcome import Refinement


def result(status, verdict=None, p=0.9):
    said = None if verdict is None else Assessment(verdict, p, 'so it is')
    return RegistrationResult(np.eye(4), status, assessment=said)


@pytest.mark.parametrize(
    ('found', 'expected'),
    [
        (result(Status.CONVERGED), True),
        (result(Status.MAX_ITERATIONS), False),
        (result(Status.CONVERGED, Verdict.ALIGNED), True),
        (result(Status.CONVERGED, Verdict.MISALIGNED, 0.1), False),
        (result(Status.CONVERGED, Verdict.OUTSIDE_BASIN, 0.1), False),
        (result(Status.CONVERGED, Verdict.LOW_OVERLAP, math.nan), False),
        (result(Status.NO_OVERLAP, Verdict.SEPARATED, 0.0), False),
        (result(Status.LATE, Verdict.NOT_CONVERGED), False),
        (result(Status.DEGENERATE, Verdict.DEGENERATE, 0.9), True),
        (result(Status.DEGENERATE, Verdict.DEGENERATE, math.nan), False),
    ],
)
def test_a_pose_is_built_upon_where_it_is_aligned_along_all_that_the_clouds_hold(found, expected):
    assert found.is_usable is expected


def test_the_verdict_leads_what_is_said_of_a_result():
    assert headline(result(Status.CONVERGED, Verdict.MISALIGNED)) == 'misaligned: so it is'
    assert headline(result(Status.CONVERGED)).startswith('converged: ')


def test_a_source_that_is_lost_is_an_error_that_says_so():
    found = result(Status.CONVERGED, Verdict.LOW_OVERLAP)
    known = ('map', 'lidar', np.eye(4), found, None, 1.0, 10, 10, 0, 0)
    lost = Refinement(1, *known, lost='no usable result for 2 s')
    assert (level(lost), message_of(lost)) == (ERROR, 'lost: no usable result for 2 s')
    assert refinement_values(lost, 0)['lost'] == 'no usable result for 2 s'
    assert 'lost' not in refinement_values(Refinement(1, *known), 0)
