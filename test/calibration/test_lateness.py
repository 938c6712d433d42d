import numpy as np
import pytest
from rigs import extrinsics, sightings

from idem_ros.calibration.fusion import difference
from idem_ros.calibration.rig_calibration import Instant, solved
from idem_ros.calibration.rig_motion import at_one_time, motion_covariances
from idem_ros.calibration.synchronized_scans import Measured
from idem_ros.core import RegistrationConfig

LATE = 0.0, 0.05, -0.03  # [s] of each sensor
CONFIG = RegistrationConfig(voxel_size=0.05, radius_schedule=(2.0, 1.0))


def seen(rng, poses):
    (row,) = sightings(rng, poses)
    return [Measured(each, np.full(len(each), late)) for each, late in zip(row, LATE, strict=True)]


def test_a_motion_that_is_wrong_moves_the_sensors_as_is_foretold(rng):
    poses = extrinsics(rng)
    measured, wrong = seen(rng, poses), np.r_[0.1, -0.05, 0.08, 0.1, -0.2, 0.15]
    found = []
    for twist in (np.zeros(6), wrong):
        clouds = tuple(at_one_time(*each, twist) for each in zip(measured, poses, strict=True))
        found.append(solved(Instant('', clouds), poses, CONFIG).poses)
    foretold = motion_covariances(measured, poses, np.outer(wrong, wrong))
    assert not foretold[0].any()
    for before, after, covariance in zip(*found, foretold, strict=True):
        off = difference(after, before)
        assert np.sqrt(covariance.diagonal()) == pytest.approx(np.abs(off), abs=1.5e-3)


def test_a_motion_that_is_known_moves_nothing(rng):
    poses = extrinsics(rng)
    assert not motion_covariances(seen(rng, poses), poses, np.zeros((6, 6))).any()


def test_sensors_that_share_nothing_or_are_silent_are_left_alone(rng):
    poses = extrinsics(rng)
    first, second, _ = seen(rng, poses)
    away = second._replace(points=second.points + 500.0)
    assert not motion_covariances([first, away, None], poses, np.eye(6)).any()
