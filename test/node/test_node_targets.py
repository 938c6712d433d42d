"""The node in this process: targets that cannot be used, and one topic as target and source."""

from node_bench import FIRST, MS, T_TRUTH, cloud_message, send, values_of

# isort: split
import numpy as np
import pytest

from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.registration_node import RegistrationNode

STEP = 100 * MS


def malformed(clouds, stamp):
    message = cloud_message(clouds[0], stamp, 'map')
    message.fields = message.fields[1:]
    return message


SPOILT = {
    'no field x': malformed,
    'NaN only': lambda clouds, stamp: cloud_message(clouds[0] * np.nan, stamp, 'map'),
    'three points': lambda clouds, stamp: cloud_message(clouds[0][:3], stamp, 'map'),
    'other frame': lambda clouds, stamp: cloud_message(clouds[0], stamp, 'odom'),
    'cropped away': lambda clouds, stamp: cloud_message(clouds[0] + 1000.0, stamp, 'map'),
}


@pytest.mark.parametrize('kind', SPOILT)
def test_a_newer_target_that_cannot_be_used_is_refused_and_the_map_serves_on(bench, clouds, kind):
    b = bench(max_range=100.0, crop_target=True).start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    for i in (1, 2, 3):
        b.target.publish(SPOILT[kind](clouds, FIRST + i * STEP - 1))
        send(b, clouds, FIRST + i * STEP, target=False)
        found = matrix_of(b.transform_of(FIRST + i * STEP))
        np.testing.assert_allclose(found, T_TRUTH, rtol=0, atol=0.02)
    b.until(lambda: b.statuses('refused'))
    assert all(each.message.startswith('target: ') for each in b.statuses('refused'))
    b.until(lambda: b.loads() and values_of(b.loads()[-1])['refused_targets'] == '3')
    assert values_of(b.loads()[-1])['refused'] == '0'


def test_each_scan_of_one_topic_is_registered_to_the_scan_before(bench, clouds):
    b = bench(guess_type='last', guess_class=None)
    remapped = ['--ros-args', '-r', '~/target:=/points', '-r', '~/source:=/points']
    b.target = b.source = b.other.create_publisher(
        type(cloud_message(clouds[0], 0, '')), '/points', 10
    )
    b.make_node(lambda **options: RegistrationNode(cli_args=remapped, **options))
    b.connected()
    moved = transform_points(inverse(T_TRUTH), clouds[0])
    for i, points in enumerate((clouds[0], moved, clouds[0])):
        b.source.publish(cloud_message(points, FIRST + i * STEP, 'lidar'))
        if i:
            b.transform_of(FIRST + i * STEP)
    b.until(lambda: b.statuses('refused'))
    assert 'which is never its own target' in b.statuses('refused')[0].message
    assert [stamp_ns(each) for each in b.received['transform']] == [FIRST + STEP, FIRST + 2 * STEP]
    for message, expected in zip(
        b.received['transform'], (T_TRUTH, inverse(T_TRUTH)), strict=True
    ):
        np.testing.assert_allclose(matrix_of(message), expected, rtol=0, atol=0.02)
