"""What is measured of several clouds, and held against the figures to reach."""

from dataclasses import replace
from time import perf_counter, process_time

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.goal import Goal
from benchmarks.several.bound import drawn_poses
from benchmarks.several.dragon import dragon
from benchmarks.several.methods import (
    CHAIN,
    DISTANCES,
    GRAPH,
    JOINT,
    MULTIWAY,
    solve_all,
    solved_by_gicp,
)
from benchmarks.several.scenes import FIRST_SEED, lidar_scans, ring
from idem_ros.core import Cloud, register_all
from idem_ros.core.geometry import se3
from idem_ros.terminal.markdown import number, table

RINGS = ((12, 0.3), (16, 0.5), (20, 0.7), (12, 0.9))  # scans, share of one that the next sees
RATIO = 0.7  # of the best other method's error
LEAST_ERROR, MOST_ERROR = 0.7, 1.4  # squared, over what the covariance promises
BOUND = 'noise alone'
DRAGON_MEDIAN, DRAGON_MOST, DRAGON_S = 0.10, 0.35, 3.0  # [deg], [deg], [s]
LIDARS, LIDARS_MS = 20, 500.0
RUNS = 3


def measure_rings(config, trials, rings=RINGS, progress=iter):
    """Return {(count, overlap): {method: errors (n,) [deg]}} over trials of each ring.

    Of multiway GICP at the distance whose median over the trials is the least. And
    {(count, overlap): squared errors of all poses at once over what is promised (trials,)}.
    """
    found, promises = {}, {}
    for count, overlap in progress(rings):
        errors, promises[count, overlap] = {}, []
        for trial in range(trials):
            scene = ring(FIRST_SEED + trial, count, overlap)
            config = replace(config, voxel_size=scene.voxel_size)
            joint, solved = solve_all(scene, config)
            for method, poses in solved.items():
                errors.setdefault(method, []).append(pose_errors(poses, scene.truth))
            drawn = drawn_poses(scene, np.random.default_rng(trial))
            of_bound = [pose_errors(poses, scene.truth) for poses in drawn]
            errors.setdefault(BOUND, []).append(np.concatenate(of_bound))
            promises[count, overlap].append(squared_error(joint, scene.truth))
        errors = {method: np.concatenate(each) for method, each in errors.items()}
        tried = [errors.pop((MULTIWAY, distance)) for distance in DISTANCES]
        errors[MULTIWAY] = min(tried, key=np.median)
        found[count, overlap] = errors
    return found, promises


def squared_error(joint, truth):
    """Return the squared error of all poses over their covariance, a degree of freedom: about 1.

    Relative to the first pose, which is held.
    """
    truth = joint.poses[0] @ se3.inverse(truth[0]) @ truth
    off = [
        np.r_[T[:3, 3] - t[:3, 3], se3.log(T @ se3.inverse(t))[:3]]
        for T, t in zip(joint.poses[1:], truth[1:], strict=True)
    ]
    error = np.concatenate(off)
    return float(error @ np.linalg.solve(joint.covariance[6:, 6:], error) / len(error))


def pose_errors(poses, truth):
    """Return how far each rotation is off (K,) [deg], the common turn that fits best left out."""
    both = zip(poses, truth, strict=True)
    off = Rotation.from_matrix([(T @ se3.inverse(t))[:3, :3] for T, t in both])
    return np.degrees((off.mean().inv() * off).magnitude())


def ring_goals(found):
    """Return a `Goal` for the median and the p90 of each ring, against the best other method."""
    goals = []
    for (count, overlap), errors in found.items():
        for name, share in (('median', 0.5), ('p90', 0.9)):
            at = {method: float(np.quantile(each, share)) for method, each in errors.items()}
            best = min(value for method, value in at.items() if method not in (JOINT, BOUND))
            figure = f'{count} scans, overlap {overlap:.0%}: {name} over the best other'
            goals.append(Goal(figure, at[JOINT] / best, RATIO))
    return goals


def promise_goals(promises):
    """Return a `Goal` for each ring: how far squared errors over covariances are from 1."""
    goals = []
    for (count, overlap), each in promises.items():
        figure = f'{count} scans, overlap {overlap:.0%}: squared errors over covariance'
        goals += [
            Goal(figure, float(np.mean(each)), MOST_ERROR),
            Goal(f'{figure}, inverse', 1.0 / float(np.mean(each)), 1.0 / LEAST_ERROR),
        ]
    return goals


def rings_table(found):
    """Return the rings' errors as a Markdown table: median / p90."""
    methods = JOINT, CHAIN, GRAPH, MULTIWAY, BOUND
    rows = [
        [
            f'{count} scans, {overlap:.0%}',
            *(_both(_median_and_p90(errors[each])) for each in methods),
            _both(_median_and_p90(errors[JOINT]) / _median_and_p90(errors[BOUND])),
        ]
        for (count, overlap), errors in found.items()
    ]
    heads = *(f'{method} [deg]' for method in methods), f'{JOINT} over {BOUND}'
    return table(('ring', *heads), rows)


def dragon_goals(config):
    """Return the `Goal`s of the dragon's ring, and what a peer says of its worst pair; or none."""
    scene = dragon()
    if scene is None:
        return [], ''
    config = replace(config, voxel_size=scene.voxel_size)
    result = register_all(scene.clouds, scene.starts, config)
    count = len(scene.clouds)
    errors = [_relative(result.poses, scene.truth, k, (k + 1) % count) for k in range(count)]
    seconds, used = _times(scene, config)
    goals = [
        Goal('dragon: median of neighbours', float(np.median(errors)), DRAGON_MEDIAN, 'deg'),
        Goal('dragon: worst of neighbours', max(errors), DRAGON_MOST, 'deg'),
        Goal('dragon: time on two cores', seconds, DRAGON_S, 's'),
        Goal('dragon: time of the processor', used, 2 * DRAGON_S, 's'),
    ]
    return goals, _worst_pair(scene, result.poses, int(np.argmax(errors)))


def _worst_pair(scene, poses, i):
    """Return in words where GICP puts scan i + 1 in scan i, from the scanner's own poses."""
    j = (i + 1) % len(poses)
    guess = se3.inverse(scene.truth[i]) @ scene.truth[j]
    T = solved_by_gicp(scene, (i, j), guess, DISTANCES[0])
    ours = se3.inverse(poses[i]) @ poses[j]
    off, apart = (np.degrees(se3.rotation_angle(se3.inverse(T) @ o)) for o in (guess, ours))
    return (
        f"The worst pair of the dragon's is scans {i} and {j}: GICP of the two, begun at the\n"
        f"scanner's own pose, leaves it by {off:.2f}° and ends {apart:.2f}° from the pose found "
        'here.\n\n'
    )


def lidar_goals(config):
    """Return the `Goal`s of scans of a street that all overlap."""
    scene = lidar_scans(FIRST_SEED, LIDARS)
    seconds, used = _times(scene, replace(config, voxel_size=scene.voxel_size))
    return [
        Goal(f'{LIDARS} LiDAR scans: time on two cores', 1e3 * seconds, LIDARS_MS, 'ms'),
        Goal(f'{LIDARS} LiDAR scans: processor', 1e3 * used, 2 * LIDARS_MS, 'ms'),
    ]


def _times(scene, config):
    """Return the least time of a solve, raw points to poses, and of the processor's [s].

    Without verdicts, which audit every edge.
    """
    config = replace(config, threads=2, assessment='none')
    taken = []
    for _ in range(RUNS):
        clouds = [Cloud(points) for points in scene.clouds]
        begin = perf_counter(), process_time()
        register_all(clouds, scene.starts, config)
        taken.append((perf_counter() - begin[0], process_time() - begin[1]))
    return np.min(taken, axis=0).tolist()


def _relative(poses, truth, i, j):
    off = se3.inverse(se3.inverse(truth[i]) @ truth[j]) @ se3.inverse(poses[i]) @ poses[j]
    return float(np.degrees(se3.rotation_angle(off)))


def _median_and_p90(errors):
    return np.quantile(errors, [0.5, 0.9])


def _both(values):
    return ' / '.join(number(each) for each in values)
