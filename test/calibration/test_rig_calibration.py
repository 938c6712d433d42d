import numpy as np
import pytest
from clouds import error_of
from rigs import extrinsics, off, sightings

from idem_ros.calibration.rig_calibration import Instant, Uncalibrated, calibrate
from idem_ros.core import Cloud, RegistrationConfig, Verdict

CONFIG = RegistrationConfig(voxel_size=0.05)


def instants_of(rows):
    return [
        Instant(str(k), tuple(None if each is None else Cloud(each) for each in row))
        for k, row in enumerate(rows)
    ]


def worst(found, truth):
    errors = [error_of(each.pose, T) for each, T in zip(found.sensors, truth, strict=True)]
    return np.max(errors, axis=0)


def test_a_rig_is_calibrated_from_one_instant(rng):
    truth = extrinsics(rng)
    found = calibrate(instants_of(sightings(rng, truth)), off(rng, truth, 5.0, 0.05), CONFIG)
    degrees, distance = worst(found, truth)
    assert degrees < 0.5
    assert distance < 0.005
    assert found.is_usable
    np.testing.assert_array_equal(found.poses[0], np.eye(4))
    assert found.sensors[1].spread is None


def test_sensors_that_meet_each_other_but_not_the_reference_are_not_calibrated(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth, instants=2)
    for row in rows:
        row[0] = row[0] + (50.0, 0.0, 0.0)
    found = calibrate(instants_of(rows), truth, CONFIG)
    assert found.usable == [False] * 3
    assert 'hang together with the reference' in found.sensors[1].verdict.reason
    assert found.sensors[1].covariance[0, 0] > 1e5


def test_where_too_little_meets_the_reference_nothing_is_said_in_its_frame(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth, instants=2)
    for row in rows:
        row[0] = row[0][:60]
    found = calibrate(instants_of(rows), truth, CONFIG)
    assert found.usable == [False] * 3


def test_starts_may_be_45_degrees_off(rng):
    truth = extrinsics(rng)
    found = calibrate(instants_of(sightings(rng, truth)), off(rng, truth, 45.0, 0.3), CONFIG)
    degrees, distance = worst(found, truth)
    assert degrees < 0.5
    assert distance < 0.005


def test_several_instants_are_fused_and_say_how_well_they_repeat(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth, instants=4)
    starts = off(rng, truth, 5.0, 0.05)
    found = calibrate(instants_of(rows), starts, CONFIG)
    assert worst(found, truth)[1] < 0.003
    for each in found.sensors[1:]:
        assert each.agreeing == (0, 1, 2, 3)
        assert 0.0 < each.spread[0] < 0.01
        assert '4 of 4 instants agree' in each.verdict.reason
    alone = calibrate(instants_of(rows[:1]), starts, CONFIG)
    assert np.trace(found.sensors[1].covariance) < np.trace(alone.sensors[1].covariance)


def test_a_sensor_that_is_silent_at_one_instant_is_calibrated_by_the_others(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth, instants=3)
    rows[1][2] = None
    found = calibrate(instants_of(rows), off(rng, truth, 5.0, 0.05), CONFIG)
    assert found.is_usable
    assert found.sensors[2].agreeing == (0, 2)


def test_a_sensor_that_meets_no_other_is_named_and_the_rest_is_calibrated(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth)
    rows[0][2] = rows[0][2] + 500.0
    found = calibrate(instants_of(rows), off(rng, truth, 5.0, 0.05), CONFIG)
    assert found.usable == [True, True, False]
    assert found.sensors[2].verdict.verdict is Verdict.SEPARATED
    assert error_of(found.poses[1], truth[1])[1] < 0.005


def test_a_sensor_without_a_cloud_stays_where_it_started(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth)
    rows[0][1] = None
    starts = off(rng, truth, 5.0, 0.05)
    found = calibrate(instants_of(rows), starts, CONFIG)
    assert not found.usable[1]
    assert 'no cloud' in found.sensors[1].verdict.reason
    np.testing.assert_array_equal(found.poses[1], starts[1])


def test_instants_without_the_reference_are_refused(rng):
    truth = extrinsics(rng)
    rows = sightings(rng, truth)
    rows[0][0] = None
    with pytest.raises(Uncalibrated, match='reference'):
        calibrate(instants_of(rows), truth, CONFIG)
