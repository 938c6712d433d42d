"""Recordings of sweeps spoilt: fields of times of any type and value, and angular rates."""

import numpy as np
from recordings import scans
from values import HOSTILE, chance

from idem_ros.messages.building import CLOUD
from idem_ros.messages.point_times import USUAL_UNIT
from idem_ros.messages.pointcloud2 import TYPES
from idem_ros.pairing.turn_rates import IMU
from idem_ros.recording.messages import cloud_message, header, typestore
from idem_ros.recording.writer import write_mcap

NUMBERS = [each for each in HOSTILE if isinstance(each, int | float)]
SWEEP, STEP = 0.1, 10**7  # [s], and [ns] between two messages of the IMU


class Sweeps:
    """Cases of sweeps whose motion is to be undone.

    Args:
        inputs: not looked at.
    """

    def __init__(self, inputs):
        self._messages = list(scans(np.random.default_rng(0), 4, points=150))

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        name, type_ = chance(rng, *USUAL_UNIT, 't', 'x'), chance(rng, *TYPES)
        messages = [self._with_times(rng, *each, name, type_) for each in self._messages]
        if rng.random() < 0.6:
            messages += _rates(rng)
        write_mcap('sweeps.mcap', sorted(messages, key=lambda each: each[1]))
        words = ['replay', 'sweeps.mcap', '--voxel-size', chance(rng, 'none', '0.2')]
        words += ['--motion', chance(rng, 'guess', 'last', 'solve')]
        for option, *values in (
            ('--point-time-from', 'field', 'azimuth'),
            ('--point-time-field', name, 'intensity', 'x'),
            ('--point-time-unit', 's', 'ms', 'us', 'ns'),
            ('--point-time-stamp-at', 'begin', 'middle', 'end'),
            ('--motion-reference', 'begin', 'middle', 'end'),
            ('--point-time-turn', '0.1', '1e-300', '1e300', '-1'),
        ):
            if rng.random() < 0.2:
                words += [option, chance(rng, *values)]
        return [*words, '--sequence', 'scan'] if rng.random() < 0.2 else words

    def _with_times(self, rng, topic, log_time, message, name, type_):
        if message.__msgtype__ != CLOUD or topic == '/target':
            return topic, log_time, message
        points = np.frombuffer(message.data, '<f4').reshape(-1, 3)
        made = cloud_message(points, log_time, 'lidar', columns={name: np.zeros(len(points))})
        whole = np.frombuffer(made.data, np.uint8).reshape(len(points), -1)[:, :12]
        with np.errstate(all='ignore'):
            column = _times(rng, len(points), log_time).astype('<' + TYPES[type_])
        data = np.hstack([whole, column[:, None].view(np.uint8)])
        made.data, made.point_step = data.reshape(-1), data.shape[1]
        made.row_step = data.size
        made.fields[3].datatype = type_ if rng.random() < 0.9 else rng.randrange(256)
        if rng.random() < 0.1:
            setattr(made.fields[3], chance(rng, 'offset', 'count'), chance(rng, 0, 13, 2**32 - 1))
        if rng.random() < 0.1:
            made.header.stamp.sec = chance(rng, 0, -(2**31), 2**31 - 1)
        return topic, log_time, made


def _times(rng, count, stamp):
    """Return (count,) float64 as a driver, or nobody, would write them."""
    times = np.linspace(0.0, SWEEP, count) * chance(rng, 1.0, 1e3, 1e6, 1e9, 1e-9, 1e300)
    times = times + chance(rng, 0.0, stamp, stamp / 1e9, 2.0**31, -SWEEP, 2.0**63)
    how = rng.random()
    if how < 0.2:
        np.random.default_rng(rng.randrange(2**32)).shuffle(times)
    elif how < 0.5:
        times[rng.randrange(count) :: rng.randint(1, count)] = chance(rng, *NUMBERS)
    return np.nan_to_num(times, nan=0.0, posinf=1e300) if how > 0.9 else times


def _rates(rng):
    """Return (topic, log time, message) of an IMU, some of them spoilt."""
    types, rate = typestore().types, chance(rng, 0.1, 10.0, 1e300, *NUMBERS)
    vector, turned = types['geometry_msgs/msg/Vector3'], types['geometry_msgs/msg/Quaternion']
    found, step = [], chance(rng, STEP, 1, 10**9)
    for k in range(chance(rng, 1, 60, 60, 60, 300)):
        stamp = 10**9 + k * step if rng.random() < 0.98 else chance(rng, 0, 2**61)
        three = [float(each) for each in (0.0, 0.0, rate if rng.random() < 0.9 else 1e999)]
        nine = np.full(9, chance(rng, 0.0, 0.0, -1.0, np.nan))
        message = types[IMU](
            header(stamp, chance(rng, *['lidar'] * 9, 'imu', '')),
            turned(0.0, 0.0, 0.0, 1.0),
            nine,
            vector(*three),
            nine,
            vector(0.0, 0.0, 9.8),
            nine,
        )
        found.append(('/imu', 10**9 + k * STEP, message))
    return found
