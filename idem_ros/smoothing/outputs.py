"""What `idem smooth` leaves in its folder: trajectory, graph, map, and how it came."""

import json
import shutil
from itertools import chain
from pathlib import Path

import numpy as np

from idem_ros.files.pcd_file import pcd_header
from idem_ros.files.pose_file import write_poses, write_tum
from idem_ros.smoothing.consistency import Consistency
from idem_ros.smoothing.joining import APART, way_along
from idem_ros.smoothing.map_blocks import MapBlocks

TRAJECTORY, GRAPH, MAP = 'trajectory.tum', 'graph.g2o', 'map.pcd'
COVARIANCES, SUMMARY = 'covariances.csv', 'smooth.json'
AXES = 'x', 'y', 'z', 'rx', 'ry', 'rz'
FLOAT32_REACH = 8192.0  # [m]: farther from zero float32 rounds by more than half a millimetre


def write_trajectory(folder, scans, poses):
    """Write the poses (S, 4, 4) of all scans as TUM lines."""
    write_tum(folder / TRAJECTORY, scans.stamps, poses)


def write_graph(folder, smoothed):
    """Write the graph: a vertex a keyframe, an edge for each relation that counts, and step."""
    relations = (
        (each.i, each.j, each.covariance, each.T_i_j) for each in smoothed.relations if each.counts
    )
    steps = ((step.target, step.source, step.covariance, step.T) for step in smoothed.steps)
    write_poses(folder / GRAPH, smoothed.poses, chain(relations, steps))


def write_covariances(folder, scans, smoothed):
    """Write a line for each keyframe: its stamp, and the upper half of its covariance."""
    upper = np.triu_indices(6)
    names = [f'{AXES[a]}_{AXES[b]}' for a, b in zip(*upper, strict=True)]
    with (folder / COVARIANCES).open('w') as stream:
        stream.write(','.join(['stamp', *names]) + '\n')
        for number, covariance in zip(scans.keyframes, smoothed.covariances, strict=True):
            seconds, rest = divmod(scans.stamps[number], 10**9)
            values = ','.join(f'{value:.9g}' for value in covariance[upper])
            stream.write(f'{seconds}.{rest:09d},{values}\n')


def write_map(folder, work, clouds, poses, voxel_size, reach):
    """Write the map of keyframes, unless `folder` is None; return (its points, `Consistency`).

    Args:
        folder: `Path`.
        work: `Path` of a folder for the map's blocks; it is left empty.
        clouds: `KeyframeClouds`.
        poses: (K, 4, 4) of the keyframes.
        voxel_size: of the map [m].
        reach: as far as a scan sees, about [m]: what is farther along the way is another pass.
    """
    work = Path(work)
    work.mkdir()
    blocks = MapBlocks(work, voxel_size)
    for number, (pose, along) in enumerate(zip(poses, way_along(poses), strict=True)):
        blocks.add(clouds.read(number), pose, along)
    found, count, farthest = Consistency(), 0, 0.0
    raw = work / 'points'
    with raw.open('wb') as stream:
        for part in blocks.parts(APART * reach):
            found, count = found.plus(part.consistency), count + len(part.points)
            farthest = max(farthest, float(np.abs(part.points).max(initial=0.0)))
            if folder is not None:
                stream.write(np.ascontiguousarray(part.points, '<f8').data)
    if folder is not None:
        _copy_points(raw, folder / MAP, count, np.float32 if farthest < FLOAT32_REACH else float)
    shutil.rmtree(work)
    return count, found


def _copy_points(raw, path, count, dtype):
    """Write a PCD of so many float64 points of another file, some at a time."""
    with raw.open('rb') as source, path.open('wb') as stream:
        stream.write(pcd_header(count, dtype))
        while len(some := np.fromfile(source, '<f8', 3 * 2**18)):
            stream.write(some.astype(np.dtype(dtype).newbyteorder('<')))


def write_summary(folder, record):
    """Write how it all came, as JSON."""
    path = folder / SUMMARY
    with path.open('w', encoding='utf-8', errors='backslashreplace') as stream:
        json.dump(record, stream, indent=1, allow_nan=False)
        stream.write('\n')
