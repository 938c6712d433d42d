import numpy as np
import pytest
from clouds import motion

from benchmarks.several.bound import drawn_poses
from benchmarks.several.measure import BOUND, pose_errors, ring_goals, rings_table
from benchmarks.several.methods import CHAIN, GRAPH, JOINT, MULTIWAY
from benchmarks.several.scenes import ring
from idem_ros.core.geometry import se3


@pytest.fixture
def poses(rng):
    return np.array([motion(rng, 40, 1.0) for _ in range(5)])


def test_a_common_turn_is_no_error(poses, rng):
    turned = motion(rng, 50, 3.0) @ poses
    np.testing.assert_allclose(pose_errors(turned, poses), 0.0, atol=1e-6)
    turned[2] = motion(rng, 5, 0.0) @ turned[2]
    assert pose_errors(turned, poses).max() == pytest.approx(4.0, abs=0.1)


def test_each_goal_is_against_the_best_of_the_others():
    errors = {JOINT: 1.0, CHAIN: 4.0, GRAPH: 2.0, MULTIWAY: 3.0, BOUND: 0.5}
    found = {(12, 0.3): {method: np.full(12, value) for method, value in errors.items()}}
    assert [goal.measured for goal in ring_goals(found)] == [0.5, 0.5]
    assert '1 / 1' in rings_table(found)
    assert rings_table(found).splitlines()[-1].endswith('2 / 2 |')


def test_noise_alone_leaves_less_open_where_scans_overlap_more(rng):
    few, many = (
        np.median([pose_errors(poses, scene.truth) for poses in drawn_poses(scene, rng)])
        for scene in (ring(0, 8, 0.4), ring(0, 8, 0.8))
    )
    assert 0.0 < many < 0.5 * few < 0.2


def test_neighbours_of_a_ring_overlap_as_much_as_is_asked_for():
    scene = ring(0, 12, 0.5)
    assert len(scene.clouds) == 12
    assert scene.pairs[0] == (0, 1)
    azimuths = []
    for cloud, T in zip(scene.clouds[:2], scene.truth, strict=False):
        placed = se3.transform_points(T, cloud)
        azimuths.append(np.arctan2(placed[:, 1], placed[:, 0]))
    shared = (azimuths[0] > azimuths[1].min() + 1e-3).mean()
    assert shared == pytest.approx(0.5, abs=0.15)
