"""Where a sensor is by its own motion and the reference's; the errors of steps are simulated."""

import numpy as np
import pytest
from clouds import error_of, motion

from idem_ros.calibration.fusion import difference
from idem_ros.calibration.hand_eye import hand_eye
from idem_ros.calibration.relative_motions import Step
from idem_ros.core import Verdict
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import CloudVerdict

RIGHT = CloudVerdict(Verdict.ALIGNED, 0.99, '')
SIGMA = np.repeat([0.004, np.radians(0.03)], 3)
TOLERANCE = 0.05, 0.3
SPACE, PLANE, STRAIGHT, STANDS = (1, 1, 1), (0, 0, 1), (0, 0, 0), None


def driven(rng, turns, count=20):
    """Return the true steps of a reference that turns about some of its axes, by up to 30 deg."""
    if turns is STANDS:
        return [np.eye(4)] * count
    steps = []
    for _ in range(count):
        turn = np.radians(rng.uniform(-30.0, 30.0, 3)) * turns
        way = rng.uniform(1.0, 4.0) * np.array([1.0, rng.uniform(-0.2, 0.2), 0.0])
        steps.append(se3.exp(np.r_[turn, way]))
    return steps


def seen(rng, T, sigma=SIGMA):
    """Return a `Step` that is off the truth as its covariance has it."""
    off = sigma * rng.normal(size=6)
    found = se3.exp(np.r_[off[3:], np.zeros(3)]) @ T
    found[:3, 3] = T[:3, 3] + off[:3]
    return Step(found, np.diag(sigma**2), RIGHT)


def pairs(rng, X, turns, **drive):
    return [(seen(rng, A), seen(rng, se3.inverse(X) @ A @ X)) for A in driven(rng, turns, **drive)]


def rig(rng, degrees=5.0, metres=0.1):
    X = motion(rng, 120.0, 1.0)
    return X, X @ motion(rng, degrees, metres)


def test_turns_about_all_axes_tell_where_it_is_from_a_far_start(rng):
    X, start = rig(rng, 40.0, 0.5)
    found = hand_eye(pairs(rng, X, SPACE), start, TOLERANCE)
    degrees, distance = error_of(found.pose, X)
    assert degrees < 0.1
    assert distance < 0.02
    assert found.verdict.verdict is Verdict.ALIGNED
    assert found.verdict.p_aligned > 0.99
    assert (found.by, len(found.agreeing)) == ('motion', 20)


@pytest.mark.parametrize('turns', [SPACE, PLANE])
def test_errors_are_as_large_as_the_covariance_says(rng, turns):
    squares = []
    for _ in range(60):
        X = motion(rng, 120.0, 1.0)
        start = se3.translation(0.5 * rng.normal(size=3)) @ X  # as START says of it
        found = hand_eye(pairs(rng, X, turns, count=12), start, TOLERANCE)
        off = difference(found.pose, X)
        squares.append(off @ np.linalg.solve(found.covariance, off) / 6)
    assert 0.7 < np.mean(squares) < 1.4


def test_a_drive_on_a_plane_leaves_the_height_as_it_started_and_names_it(rng):
    X, start = rig(rng)
    found = hand_eye(pairs(rng, X, PLANE), start, TOLERANCE)
    assert found.verdict.verdict is Verdict.DEGENERATE
    assert 'leaves open where it is along z by 0.' in found.verdict.reason
    assert found.pose[2, 3] == pytest.approx(start[2, 3], abs=0.05)
    assert np.sqrt(found.covariance[2, 2]) == pytest.approx(0.5, rel=0.1)
    assert np.linalg.norm(found.pose[:2, 3] - X[:2, 3]) < 0.02
    assert error_of(found.pose, X)[0] < 0.15


def test_the_height_is_told_by_as_much_as_the_drive_tilts(rng):
    X, start = rig(rng)
    sure = []
    for tilt in (0.02, 0.1, 0.5):
        found = hand_eye(pairs(rng, X, (tilt, tilt, 1)), start, TOLERANCE)
        sure.append(np.sqrt(found.covariance[2, 2]))
    assert sure[0] > 2 * sure[1] > 4 * sure[2]
    assert sure[2] < 0.02


@pytest.mark.parametrize('turns', [STRAIGHT, STANDS])
def test_without_bends_nothing_is_told_of_the_place(rng, turns):
    X, start = rig(rng)
    found = hand_eye(pairs(rng, X, turns), start, TOLERANCE)
    assert found.verdict.verdict is Verdict.NOT_CONVERGED
    assert 'along x and y and z' in found.verdict.reason
    assert np.linalg.norm(found.pose[:3, 3] - start[:3, 3]) < 0.01
    assert np.sqrt(np.diag(found.covariance)[:3]) == pytest.approx([0.5] * 3, rel=0.05)


def test_steps_that_are_wrong_are_outvoted_and_counted(rng):
    X, start = rig(rng)
    given = pairs(rng, X, SPACE)
    for k in (3, 8, 15):
        wrong = se3.translation(np.array([0.5, 0.0, 0.2])) @ given[k][1].T
        given[k] = given[k][0], given[k][1]._replace(T=wrong)
    found = hand_eye(given, start, TOLERANCE)
    assert error_of(found.pose, X)[1] < 0.03
    assert not {3, 8, 15} & set(found.agreeing)
    assert f'{len(found.agreeing)} of 20 steps agree' in found.verdict.reason


def test_one_step_alone_is_no_calibration(rng):
    X, start = rig(rng)
    found = hand_eye(pairs(rng, X, SPACE, count=1), start, TOLERANCE)
    assert found.verdict.verdict is Verdict.NOT_CONVERGED
