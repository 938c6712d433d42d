import numpy as np
import pytest
from rigs import extrinsics, sightings

from idem_ros.calibration.fusion import contradiction
from idem_ros.core import Cloud, RegistrationConfig, register_all

CONFIG = RegistrationConfig(voxel_size=0.05, radius_schedule=(2.0, 1.0))


@pytest.fixture
def rig(rng):
    truth = extrinsics(rng)
    return truth, sightings(rng, truth)[0]


def factor(clouds, truth):
    clouds = [Cloud(each) for each in clouds]
    return contradiction(clouds, register_all(clouds, truth, CONFIG), CONFIG)


def test_a_scan_that_is_bent_contradicts_the_others(rig):
    truth, clouds = rig
    straight = factor(clouds, truth)
    bent = clouds[2].copy()
    bent[:, 0] += 0.1 * bent[:, 1] ** 2
    assert 1.0 <= straight < 4.0
    assert factor([*clouds[:2], bent], truth) > 3.0 * straight


def test_two_clouds_close_no_loop(rig):
    truth, clouds = rig
    assert factor(clouds[:2], truth[:2]) == 1.0
    assert np.isfinite(factor(clouds, truth))
