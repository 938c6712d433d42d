from types import SimpleNamespace as Record

import numpy as np
import pytest
from clouds import motion

from idem_ros.core import InvalidTransform
from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.messages.transform_message import matrix_of, stamp_ns, translation_and_quaternion


def message(translation=(0.0, 0.0, 0.0), quaternion=(0.0, 0.0, 0.0, 1.0)):
    return Record(
        transform=Record(
            translation=Record(**dict(zip('xyz', translation, strict=True))),
            rotation=Record(**dict(zip('xyzw', quaternion, strict=True))),
        )
    )


def test_a_matrix_survives_the_way_through_a_message(rng):
    for degrees in (0.0, 1e-6, 90.0, 179.999999):
        matrix = motion(rng, degrees, 3.0)
        again = matrix_of(message(*translation_and_quaternion(matrix)))
        np.testing.assert_allclose(again, matrix, rtol=0, atol=1e-14)


def test_the_quaternion_is_normalised():
    matrix = matrix_of(message(quaternion=(0.0, 0.0, 5.0, 5.0)))
    np.testing.assert_allclose(matrix[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize(
    'changes',
    [
        {'quaternion': (0.0, 0.0, 0.0, 0.0)},
        {'quaternion': (0.0, 0.0, 1e-200, 0.0)},
        {'quaternion': (0.0, 0.0, 1e200, 0.0)},
        {'quaternion': (np.nan, 0.0, 0.0, 1.0)},
        {'translation': (0.0, np.inf, 0.0)},
    ],
)
def test_what_is_no_transform_is_refused(changes):
    with pytest.raises(InvalidTransform, match=r'quaternion \(?'):
        matrix_of(message(**changes))


@pytest.mark.parametrize('far', [2e100, -1e200, 1.7e308])
def test_what_is_farther_than_anything_is_refused(far):
    with pytest.raises(InvalidTransform, match='which nothing measures'):
        matrix_of(message(translation=(0.0, far, 0.0)))
    with pytest.raises(InvalidTransform, match='which nothing measures'):
        checked_transform(np.diag([far, 1.0, 1.0, 1.0]))


def test_a_stamp_keeps_every_nanosecond():
    stamped = Record(header=Record(stamp=Record(sec=1_700_000_000, nanosec=123_456_789)))
    assert stamp_ns(stamped) == 1_700_000_000_123_456_789


def test_the_parts_are_plain_python_floats(rng):
    translation, quaternion = translation_and_quaternion(motion(rng, 10.0, 1.0))
    assert {type(number) for number in (*translation, *quaternion)} == {float}
