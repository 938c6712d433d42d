"""The node in this process: sweeps of a sensor that moves are undone and published."""

from node_bench import guess_message, values_of

# isort: split
import numpy as np
from sensor_msgs.msg import PointCloud2
from sweeps import FRAMES, PERIOD, SPOILT, START, TWIST, driven, map_message, sweep_message

from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.node.messages import cloud_message

STAMP = START + 3 * PERIOD


def live(recorded):
    """The same PointCloud2 in rclpy's class."""
    read, names = read_points(recorded), [field.name for field in recorded.fields]
    packed = np.frombuffer(recorded.data, np.float32).reshape(-1, len(names))
    columns = {'time': packed[:, names.index('time')]} if 'time' in names else None
    stamp, frame = stamp_ns(recorded), recorded.header.frame_id
    return cloud_message(read.points, stamp, frame, columns=columns)


def test_the_undone_cloud_goes_out_and_the_diagnostics_tell_the_motion(bench, rng):
    b = bench(motion='guess', voxel_size=0.08, motion_reference='middle').start()
    undone = []
    b.other.create_subscription(PointCloud2, '/idem_node/undistorted', undone.append, 10)
    b.until(lambda: b.node.count_subscribers('/idem_node/undistorted'))
    b.target.publish(live(map_message(rng)))
    for k in range(10):
        stamp = STAMP + (k - 4) * PERIOD // 4
        b.guess.publish(guess_message(driven((stamp - START) / 1e9), stamp, *FRAMES))
    b.source.publish(live(sweep_message(rng, driven, STAMP)))
    b.until(lambda: undone and b.received['transform'] and b.statuses('converged'))
    (transform,) = b.received['transform']
    truth = driven((stamp_ns(transform) - START) / 1e9)
    assert abs(stamp_ns(transform) - STAMP - PERIOD // 2) < 2e6
    np.testing.assert_allclose(matrix_of(transform), truth, atol=0.01)
    assert stamp_ns(undone[0]) == stamp_ns(transform)
    assert undone[0].header.frame_id == FRAMES[1]
    assert len(read_points(undone[0]).points) == 2500
    values = values_of(b.statuses('converged')[0])
    assert values['motion'] == 'undone'
    np.testing.assert_allclose([float(v) for v in values['twist'].split()], TWIST, atol=1e-3)
    assert 'source: field time (float32) in s' in values['point_times']


def test_sources_whose_times_cannot_be_used_are_answered_as_they_are(bench, rng):
    b = bench(motion='guess', voxel_size=0.08).start()
    b.target.publish(live(map_message(rng)))
    for k, how in enumerate(SPOILT, start=1):
        stamp = STAMP + 3 * k * PERIOD
        for at in (stamp, stamp + PERIOD):
            b.guess.publish(guess_message(driven((at - START) / 1e9 % 1.0), at, *FRAMES))
        source = sweep_message(rng, lambda t: driven(t % 1.0), stamp, timed=how, count=1500)
        b.source.publish(live(source))
        b.until(lambda k=k: len(b.statuses('converged')) == k)
    assert len(b.received['transform']) == len(SPOILT)
    told = [values_of(status) for status in b.statuses('converged')]
    assert [each['motion'] for each in told] == ['none'] * len(SPOILT)
    for how, each in zip(SPOILT, told, strict=True):
        assert SPOILT[how][1] in each['point_times'], how


def test_a_source_whose_guesses_do_not_cover_its_sweep_is_refused_and_the_gap_is_named(bench, rng):
    b = bench(motion='guess', voxel_size=0.08).start()
    b.target.publish(live(map_message(rng)))
    for at in (STAMP - PERIOD, STAMP):
        b.guess.publish(guess_message(driven((at - START) / 1e9), at, *FRAMES))
    b.source.publish(live(sweep_message(rng, driven, STAMP, duration=0.4)))
    for k in (1, 2):  # it waits until the second source after it
        b.source.publish(live(sweep_message(rng, driven, STAMP + k * PERIOD)))
    b.until(lambda: b.statuses('refused'))
    assert 'end before the sweep does, by 0.4 s' in b.statuses('refused')[0].message
