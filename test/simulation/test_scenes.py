"""The scenes, the drives through them, and whether they constrain all of a pose."""

import numpy as np
import pytest
from clouds import error_of, motion

from idem_ros.core import InvalidConfig, RegistrationConfig, register
from idem_ros.core.geometry import se3
from idem_ros.replay.frames import rotation_error_deg, translation_error_m
from idem_ros.simulation.drive import drive, perturbed
from idem_ros.simulation.forest import forest
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.room import room
from idem_ros.simulation.street import street
from idem_ros.simulation.surfaces import Scene, merged, placed

SCENES = {street: 0.5, room: 0.15, forest: 0.5}
KINDS = ('triangles', 'boxes', 'cylinders', 'spheres', 'route')


@pytest.mark.parametrize(('build', 'voxel_size'), SCENES.items())
def test_two_scans_of_a_scene_find_their_true_pose(build, voxel_size):
    rng = np.random.default_rng(3)
    scene = build(rng)
    here, there = drive(scene, 41, rng)[20:22]
    target, source = (scan(scene, pose, Lidar(), rng) for pose in (here, there))
    truth = se3.inverse(here) @ there
    assert min(len(target), len(source)) > 10_000
    guess = perturbed(truth, 2.0, voxel_size, rng)
    result = register(target, source, guess, RegistrationConfig(voxel_size=voxel_size))
    assert result.converged
    degrees, metres = error_of(result.T_target_source, truth)
    assert degrees < 0.2
    assert metres < 0.02


@pytest.mark.parametrize('build', SCENES)
def test_a_seed_gives_the_same_scene(build):
    first, again, other = (build(np.random.default_rng(seed)) for seed in (1, 1, 2))
    for kind in KINDS:
        np.testing.assert_array_equal(getattr(first, kind), getattr(again, kind))
    assert not np.array_equal(first.route, other.route)


@pytest.mark.parametrize('build', SCENES)
def test_a_drive_follows_the_route_upright(build):
    rng = np.random.default_rng(2)
    scene = build(rng)
    poses = drive(scene, 11, rng)
    for pose in poses:
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        gaps = np.linalg.norm(scene.route[:, :2] - pose[:2, 3], axis=1)
        assert gaps.min() < 0.5
        assert pose[2, 3] - scene.route[gaps.argmin(), 2] == pytest.approx(1.8, abs=0.2)
        assert pose[2, 2] > np.cos(np.radians(15))
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    assert steps.max() < 1.2 * steps.min()


def test_a_drive_needs_a_route_and_two_poses(rng):
    with pytest.raises(InvalidConfig, match='route of 0 points'):
        drive(Scene(), 5, rng)
    with pytest.raises(InvalidConfig, match='1 scans'):
        drive(street(rng), 1, rng)


def test_a_perturbed_pose_is_off_by_exactly_that(rng):
    T = motion(rng, 30, 5)
    for _ in range(5):
        off = perturbed(T, 1.5, 0.3, rng)
        assert rotation_error_deg(off, T) == pytest.approx(1.5)
        assert translation_error_m(off, T) == pytest.approx(0.3)


def test_parts_are_placed_rigidly_and_merged_whole(rng):
    part = Scene(
        triangles=rng.random((2, 3, 3)),
        boxes=[(1, 0, 0, 1, 2, 3, 0.1)],
        cylinders=[(1, 0, 0, 2, 0.5)],
        spheres=[(1, 0, 0, 0.5)],
    )
    moved = placed(part, 10.0, 0.0, 1.0, yaw=np.pi / 2)
    np.testing.assert_allclose(moved.boxes[0], (10, 1, 1, 1, 2, 3, 0.1 + np.pi / 2), atol=1e-12)
    np.testing.assert_allclose(moved.cylinders[0], (10, 1, 1, 3, 0.5), atol=1e-12)
    np.testing.assert_allclose(moved.spheres[0], (10, 1, 1, 0.5), atol=1e-12)
    both = merged([part, moved])
    assert [len(getattr(both, kind)) for kind in KINDS[:4]] == [4, 2, 2, 2]
