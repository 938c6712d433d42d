"""Folders of scans with exact poses, in both layouts that are read."""

import numpy as np
from clouds import motion, surface
from plyfile import PlyData, PlyElement
from trajectories import write_kitti

from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.files.pose_file import write_tum


def scans(rng, count=4, points=300):
    """Poses of a sensor that moves around a surface, and what it sees there: float32."""
    poses = [motion(rng, 20.0, 3.0)]
    for _ in range(count - 1):
        poses.append(poses[-1] @ motion(rng, 3.0, 0.1))
    seen = [transform_points(inverse(pose), surface(rng, points)) for pose in poses]
    return np.array(poses), [cloud.astype(np.float32) for cloud in seen]


def write_kitti_sequence(folder, rng, poses, clouds, poses_file=None):
    """Write a KITTI odometry sequence whose camera poses follow from those of the LiDAR."""
    lidar_in_camera = motion(rng, 100.0, 0.3)
    (folder / 'velodyne').mkdir(parents=True)
    for k, cloud in enumerate(clouds):
        np.c_[cloud, np.zeros(len(cloud))].astype('<f4').tofile(
            folder / 'velodyne' / f'{k:06d}.bin'
        )
    write_kitti(poses_file or folder / 'poses.txt', poses @ inverse(lidar_in_camera))
    numbers = ' '.join(f'{number:.15e}' for number in lidar_in_camera[:3].ravel())
    (folder / 'calib.txt').write_text(f'P0: {"0 " * 12}\nTr: {numbers}\n')


def write_numbered(folder, poses, clouds, stamps):
    """Write scan_2.ply, scan_10.ply and so on, and the trajectory poses.tum beside them."""
    folder.mkdir()
    for k, cloud in enumerate(clouds):
        vertices = np.array([tuple(p) for p in cloud], dtype=[(n, 'f4') for n in 'xyz'])
        element = PlyElement.describe(vertices, 'vertex')
        PlyData([element]).write(folder / f'scan_{2 + 8 * k}.ply')
    write_tum(folder / 'poses.tum', stamps, poses)
