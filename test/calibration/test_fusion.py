import numpy as np
import pytest
from clouds import motion

from idem_ros.calibration.fusion import difference, fused
from idem_ros.calibration.rig_calibration import Instant, Solved
from idem_ros.core import Cloud, Verdict
from idem_ros.core.geometry import se3
from idem_ros.core.several.joint_result import CloudVerdict

SIGMA = np.r_[0.01, 0.02, 0.01, 0.002, 0.001, 0.002]
GOOD = CloudVerdict(Verdict.ALIGNED, 0.9, 'good')
BAD = CloudVerdict(Verdict.MISALIGNED, 0.1, 'bad')
TOLERANCE = 0.05, 0.3


def moved(pose, off):
    result = pose.copy()
    result[:3, :3] = se3.exp(np.r_[off[3:], np.zeros(3)])[:3, :3] @ pose[:3, :3]
    result[:3, 3] += off[:3]
    return result


def solved(poses, verdicts=None, sigma=SIGMA):
    """Instants of two sensors, of which the second is at these poses."""
    cloud = Cloud(np.eye(5, 3))
    covariances = np.array([np.zeros((6, 6)), np.diag(sigma**2)])
    verdicts = verdicts or [GOOD] * len(poses)
    return [
        Solved(
            Instant(str(k), (cloud, cloud)),
            np.array([np.eye(4), pose]),
            covariances,
            (GOOD, said),
            (True, True),
            None,
        )
        for k, (pose, said) in enumerate(zip(poses, verdicts, strict=True))
    ]


@pytest.fixture
def truth(rng):
    return motion(rng, 70.0, 1.0)


def test_errors_as_promised_leave_a_covariance_that_is_true(rng, truth):
    squares = []
    for _ in range(200):
        poses = [moved(truth, rng.normal(size=6) * SIGMA) for _ in range(5)]
        found = fused(solved(poses), 1, TOLERANCE, 5)
        off = difference(found.pose, truth)
        squares.append(off @ np.linalg.solve(found.covariance, off) / 6)
    assert 0.7 < np.mean(squares) < 1.3


def test_instants_that_scatter_more_than_promised_make_it_larger(rng, truth):
    poses = [moved(truth, 3.0 * rng.normal(size=6) * SIGMA) for _ in range(8)]
    tight, loose = (
        fused(solved(poses, sigma=sigma), 1, (1.0, 10.0), 8) for sigma in (SIGMA, 3.0 * SIGMA)
    )
    ratio = np.trace(tight.covariance) / np.trace(loose.covariance)
    assert 0.4 < ratio < 2.5


def test_instants_of_one_place_promise_no_more_than_one(truth):
    poses = [truth] * 4
    one, four = (fused(solved(poses), 1, TOLERANCE, n).covariance for n in (1, 4))
    np.testing.assert_allclose(one, np.diag(SIGMA**2), rtol=1e-6)
    np.testing.assert_allclose(four, np.diag(SIGMA**2) / 4, rtol=1e-6)


def test_one_instant_that_is_far_off_is_left_out(rng, truth):
    poses = [moved(truth, 0.1 * rng.normal(size=6) * SIGMA) for _ in range(4)]
    poses[1] = moved(truth, np.r_[1.0, 0, 0, 0, 0, 0.3])
    found = fused(solved(poses), 1, TOLERANCE, 4)
    assert found.agreeing == (0, 2, 3)
    assert np.linalg.norm(difference(found.pose, truth)[:3]) < 0.01
    assert found.verdict.verdict is Verdict.ALIGNED


def test_instants_of_which_no_two_agree_are_misaligned(truth):
    poses = [moved(truth, np.r_[k, 0, 0, 0, 0, 0.2 * k]) for k in range(4)]
    found = fused(solved(poses), 1, TOLERANCE, 4)
    assert found.verdict.verdict is Verdict.MISALIGNED
    assert 'only 1 of 4 instants agree' in found.verdict.reason


def test_instants_that_agree_are_all_wrong_together_or_none(truth):
    doubtful = CloudVerdict(Verdict.MISALIGNED, 0.3, 'doubtful')
    apart, one_place, two = (
        fused(solved([truth] * n, [doubtful] * n), 1, TOLERANCE, places).verdict
        for n, places in ((3, 3), (3, 1), (1, 1))
    )
    assert apart.verdict is Verdict.ALIGNED
    assert apart.p_aligned == pytest.approx(1 - 0.7**3)
    assert one_place.verdict is Verdict.MISALIGNED
    assert one_place.p_aligned == pytest.approx(0.3)
    assert two == doubtful


def test_one_good_verdict_speaks_for_instants_that_agree_with_it(truth):
    found = fused(solved([truth] * 3, [BAD, GOOD, BAD]), 1, TOLERANCE, 3)
    assert found.verdict.verdict is Verdict.ALIGNED
    assert fused(solved([truth] * 3, [BAD] * 3), 1, TOLERANCE, 3).verdict.verdict is BAD.verdict
