"""The node in this process, against maps: from a file, and large ones that follow each other."""

from node_bench import FIRST, MS, T_TRUTH, cloud_message, send, values_of

# isort: split
import numpy as np
import pytest

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.transform_message import matrix_of
from idem_ros.node.worker import LARGE

STEP = 100 * MS


def large(points, rng):
    """The same surfaces in more points than a scan has."""
    points = np.repeat(points, LARGE // len(points) + 1, axis=0)
    return points + rng.normal(0.0, 0.01, points.shape)


@pytest.fixture
def map_file(tmp_path, clouds):
    np.save(tmp_path / 'map.npy', clouds[0])
    return str(tmp_path / 'map.npy')


def test_scans_are_registered_to_a_map_from_a_file_and_no_target_is_listened_to(
    bench, clouds, map_file
):
    b = bench(target_file=map_file, target_frame='map')
    b.make_node()
    b.until(lambda: b.source.get_subscription_count() and b.guess.get_subscription_count())
    send(b, clouds, FIRST, target=False)
    message = b.transform_of(FIRST)
    np.testing.assert_allclose(matrix_of(message), T_TRUTH, rtol=0, atol=0.02)
    assert message.header.frame_id == 'map'
    assert b.target.get_subscription_count() == 0


@pytest.mark.parametrize(
    ('given', 'says'),
    [
        ({'target_file': '/none.pcd'}, '/none.pcd is not there'),
        ({'target_frame': '', 'target_file': '/none.pcd'}, 'target_frame'),
    ],
)
def test_a_map_that_cannot_be_used_ends_the_start_in_one_line(bench, given, says):
    with pytest.raises(IdemError, match=says) as refused:
        bench(**given).make_node()
    assert '\n' not in str(refused.value)


def test_a_new_large_map_replaces_the_one_before_and_garbage_does_not(bench, clouds, rng):
    b = bench(pairing='newest').start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    moved = large(clouds[0] + (0.05, 0.0, 0.0), rng)
    b.target.publish(cloud_message(moved, FIRST + 1, 'map'))
    found, i = [], 0
    while not found or abs(found[-1][0, 3] - T_TRUTH[0, 3] - 0.05) > 0.02:
        i += 1
        send(b, clouds, FIRST + i * STEP, target=False)
        found.append(matrix_of(b.transform_of(FIRST + i * STEP)))
    garbage = np.full((LARGE + 1, 3), np.nan)
    b.target.publish(cloud_message(garbage, FIRST + 2, 'map'))
    b.until(lambda: b.loads() and values_of(b.loads()[-1])['refused_targets'] == '1')
    send(b, clouds, FIRST + (i + 1) * STEP, target=False)
    after = matrix_of(b.transform_of(FIRST + (i + 1) * STEP))
    np.testing.assert_allclose(after, found[-1], rtol=0, atol=0.02)
    assert values_of(b.loads()[-1])['refused'] == '0'


def test_parts_of_a_map_are_put_together(bench, clouds):
    b = bench(target_mode='accumulate', target_voxel_size=0.01).start()
    halves = clouds[0][: len(clouds[0]) // 2], clouds[0][len(clouds[0]) // 2 :]
    for i, points in enumerate(halves):
        b.target.publish(cloud_message(points, FIRST - 5 + i, 'map'))
    b.until(lambda: b.node.registration.inputs.pairing.has_target())
    send(b, clouds, FIRST, target=False)
    np.testing.assert_allclose(matrix_of(b.transform_of(FIRST)), T_TRUTH, rtol=0, atol=0.02)
