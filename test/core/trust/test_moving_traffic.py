"""Of two bodies that a sensor sees move apart neither is surely the place."""

from functools import partial

import numpy as np
import pytest

from benchmarks.trust.convoys import LANES, convoy
from benchmarks.trust.places import PLACES
from benchmarks.trust.sensors import place_case
from idem_ros.core import RegistrationConfig, Verdict, register

SAID = 'move along with the sensor'


def registered(case, guess):
    config = RegistrationConfig(voxel_size=case.voxel_size)
    return register(case.target, case.source, guess, config)


@pytest.mark.parametrize('kind', ['motorway', 'tunnel'])
def test_a_scan_that_fits_the_vehicles_around_it_is_not_taken_for_aligned(kind):
    case = place_case(kind, 116, partial(convoy, LANES[kind]))
    result = registered(case, np.eye(4))
    assert abs(result.T_target_source[0, 3]) < 0.1 < case.truth[0, 3]
    said = result.assessment
    assert said.verdict is Verdict.MISALIGNED
    assert SAID in said.reason
    assert said.p_aligned <= 0.5
    assert not result.is_usable


def test_the_right_pose_among_few_vehicles_is_aligned_and_names_them():
    case = place_case('town', 113, partial(convoy, LANES['town']))
    result = registered(case, case.truth)
    assert np.linalg.norm(result.T_target_source[:3, 3] - case.truth[:3, 3]) < 0.05
    assert result.is_usable
    assert SAID in result.assessment.reason
    assert ' across x ' in result.assessment.reason


@pytest.mark.parametrize('kind', ['street', *PLACES])
def test_nothing_is_said_to_move_where_nothing_does(kind):
    case = place_case(kind, 115)
    assert SAID not in registered(case, case.truth).assessment.reason
