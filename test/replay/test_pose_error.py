import numpy as np
import pytest
from clouds import motion

from idem_ros.replay.frames import rotation_error_deg, translation_error_m


@pytest.mark.parametrize('degrees', [0.0, 1e-4, 0.05, 90.0, 179.9])
def test_errors_are_the_angle_and_the_distance_that_were_put_in(rng, degrees):
    truth, off = motion(rng, 50.0, 1e3), motion(rng, degrees, 0.0)
    estimate = truth @ off
    estimate[:3, 3] += (0.3, 0.0, 0.4)
    assert rotation_error_deg(estimate, truth) == pytest.approx(degrees, abs=1e-9)
    assert translation_error_m(estimate, truth) == pytest.approx(0.5, abs=1e-9)


def test_errors_are_the_same_in_both_directions(rng):
    a, b = motion(rng, 10.0, 1.0), motion(rng, 20.0, 2.0)
    assert rotation_error_deg(a, b) == pytest.approx(rotation_error_deg(b, a), rel=1e-12)
    assert translation_error_m(a, b) == translation_error_m(b, a)
    assert rotation_error_deg(a, a) == pytest.approx(0.0, abs=1e-6)


def test_errors_are_plain_floats():
    assert type(rotation_error_deg(np.eye(4), np.eye(4))) is float
    assert type(translation_error_m(np.eye(4), np.eye(4))) is float
