from dataclasses import replace

import numpy as np
import pytest
from clouds import error_of
from poses import imu, odometry, tf, transform
from scipy.spatial.transform import Rotation
from sweeps import FRAMES, PERIOD, START, driven, map_message, sweep_message

from idem_ros.core import RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pairing import Pairing
from idem_ros.refinement.refiner import Refiner

CONFIG = RegistrationConfig(voxel_size=0.08, motion='guess')
STAMP = START + PERIOD
MS = 10**6


def swinging(seconds):
    """The pose of a sensor that swings about its vertical axis while it drives."""
    pose = driven(0.0)
    pose[:3, :3] = Rotation.from_euler('z', 0.15 * np.sin(60.0 * seconds)).as_matrix()
    pose[0, 3] = 1.5 * seconds
    return pose


def rate_at(stamp, path):
    """The angular rate of a path in its own axes."""
    seconds, step = (stamp - START) / 1e9, 1e-4
    turn = se3.inverse(path(seconds - step)) @ path(seconds + step)
    return Rotation.from_matrix(turn[:3, :3]).as_rotvec() / (2 * step)


def paired(rng, frame=FRAMES[1], R_source_imu=None, guess_type='odometry', every=5, **changes):
    """The pair of a source with guesses at its begin and end, and an IMU at 200 Hz."""
    turn = np.eye(3) if R_source_imu is None else R_source_imu
    pairing = Pairing(guess_config=GuessConfig(type=guess_type))
    pairing.add_target(map_message(rng))
    for k in range(-10, 30):
        stamp = STAMP + k * every * MS
        rate = changes.get('rate', lambda stamp: rate_at(stamp, swinging))(stamp)
        measures = changes.get('measures', True)
        pairing.add_imu(imu(stamp, turn.T @ rate, frame, measures))
    if guess_type == 'tf':
        mount = np.eye(4)
        mount[:3, :3] = turn
        pairing.add_static_transforms(tf(transform(0, mount, FRAMES[1], frame)))
    for stamp in (STAMP, STAMP + PERIOD):
        pose = swinging((stamp - START) / 1e9)
        told = (transform if guess_type == 'tf' else odometry)(stamp, pose, *FRAMES)
        pairing.add_guess(tf(told) if guess_type == 'tf' else told)
    (pair,) = pairing.add_source(sweep_message(rng, swinging, STAMP))
    return pair


def error_with(pair):
    refinement = Refiner(CONFIG).refine(pair)
    truth = swinging(PERIOD / 1e9)
    return error_of(refinement.result.T_target_source, truth)[0], refinement.point_times


def test_an_imu_tells_how_the_sensor_turned_between_the_guesses(rng):
    pair = paired(rng)
    degrees, said = error_with(pair)
    assert degrees < 0.3
    assert "imu: the rates of 'lidar' tell the rotation" in said
    assert error_with(replace(pair, rates=None))[0] > 4 * degrees


def test_an_imu_in_a_frame_of_its_own_is_turned_as_tf_has_it(rng):
    turned = Rotation.from_euler('xyz', [180.0, 0.0, 90.0], degrees=True).as_matrix()
    degrees, _ = error_with(paired(rng, 'imu', turned, guess_type='tf'))
    assert degrees < 0.3


@pytest.mark.parametrize(
    ('changes', 'why'),
    [
        ({'frame': 'imu'}, "nothing tells how its frame 'imu' is turned"),
        ({'every': 60}, 'a gap of 0.06 s'),
        ({'every': 0}, 'two are needed'),
        ({'rate': lambda stamp: [np.nan] * 3}, 'is not finite'),
        ({'rate': lambda stamp: [0.0, 1e200, 0.0]}, 'which no gyroscope measures'),
        ({'measures': False}, 'it measures no angular rates'),
    ],
)
def test_rates_that_tell_nothing_are_left_out_and_why_is_said(rng, changes, why):
    pair = paired(rng, **changes)
    without, _ = error_with(replace(pair, rates=None))
    degrees, said = error_with(pair)
    assert degrees == without
    assert why in said
    assert 'taken as none' in said


def test_rates_from_before_a_clock_was_set_back_are_forgotten(rng):
    pairing = Pairing(guess_config=GuessConfig(type='identity'))
    pairing.add_target(map_message(rng))
    pairing.add_imu(imu(STAMP + 10**10, [0.0, 0.0, 1.0], FRAMES[1]))
    pairing.add_imu(imu(STAMP, [0.0, 0.0, 1.0], FRAMES[1]))
    (pair,) = pairing.add_source(sweep_message(rng, swinging, STAMP))
    assert pair.rates.messages.stamps == (STAMP,)
