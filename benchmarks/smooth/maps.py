"""Maps of scans whose poses are off, of several densities: what tells how far they are off."""

from importlib import import_module

import numpy as np
from scipy.stats import spearmanr

from benchmarks.goal import Goal
from idem_ros.core.geometry import se3
from idem_ros.simulation.drive import drive
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.smoothing.consistency import Consistency
from idem_ros.smoothing.map_blocks import MapBlocks
from idem_ros.terminal.markdown import number, table

FIRST_SEED = 4000  # of what is reported; numbers were chosen on seeds 0 to 3
SCENES = 'street', 'room', 'forest'
RATIOS = 1, 2, 5, 10  # of the points of one pass over those of the other
STOPS, SIDE = 8, 0.5  # of each pass; [m] that it keeps from the middle
LIDAR = Lidar(azimuth_steps=700)
VOXEL_SIZE = 0.25  # [m]
NOISE = 0.005, 0.15  # [m] of each axis of a pose; a tenth of it in rad, of each axis
LEAST_CORRELATION = 0.95


def measure_maps(seeds, maps, folder, progress=iter):
    """Return rows (scene, ratio, true noise [m], score, mean map entropy) of maps.

    Args:
        seeds: how many of each scene.
        maps: of each, with noise of their own.
        folder: `Path` for blocks.
        progress: wraps the iteration over scenes.
    """
    rows = []
    for kind, seed in progress([(kind, seed) for kind in SCENES for seed in range(seeds)]):
        rng = np.random.default_rng([FIRST_SEED + seed, 7])
        scans = _scans(kind, rng)
        for k in range(maps):
            ratio = RATIOS[k % len(RATIOS)]
            made, noise = _disturbed(scans, ratio, rng)
            found = _consistency(made, folder / f'{kind}{seed}_{k}')
            rows.append((kind, ratio, noise, found.score, found.mean_map_entropy))
    return rows


def _scans(kind, rng):
    scene = getattr(import_module(f'idem_ros.simulation.{kind}'), kind)(rng)
    poses = [T for side in (SIDE, -SIDE) for T in drive(scene, STOPS, rng, lateral_m=side)]
    return [(scan(scene, T, LIDAR, rng), T) for T in poses]


def _disturbed(scans, ratio, rng):
    """Return scans at poses that are off, those of the second pass thinner, and by how much [m].

    That is the root mean square over the axes of the positions.
    """
    sigma, made, off = float(np.exp(rng.uniform(*np.log(NOISE)))), [], []
    for k, (points, T) in enumerate(scans):
        kept = points if k < STOPS else points[rng.random(len(points)) < 1.0 / ratio]
        pose, shift = T.copy(), rng.normal(0.0, sigma, 3)
        turn = se3.exp(np.r_[rng.normal(0.0, sigma / 10, 3), np.zeros(3)])
        pose[:3, :3] = turn[:3, :3] @ T[:3, :3]
        pose[:3, 3] += shift
        made.append((kept, pose))
        off.append(shift)
    return made, float(np.sqrt(np.mean(np.square(off))))


def _consistency(scans, folder):
    folder.mkdir()
    blocks, found = MapBlocks(folder, VOXEL_SIZE), Consistency()
    for k, (points, pose) in enumerate(scans):
        blocks.add(points, pose, float(k))
    for part in blocks.parts(gap=float(len(scans))):
        found = found.plus(part.consistency)
    return found


def correlations(rows):
    """Return Spearman's rank correlation with the true noise, of the score and the entropy."""
    noise, score, entropy = (np.array([row[k] for row in rows]) for k in (2, 3, 4))
    return tuple(float(spearmanr(noise, each).statistic) for each in (score, entropy))


def map_goals(rows):
    """Return the `Goal`s of the score, over all scenes and densities."""
    score, entropy = correlations(rows)
    return [
        Goal('1 less the rank correlation of the score', 1.0 - score, 1.0 - LEAST_CORRELATION),
        Goal('that of the mean map entropy less that of the score', entropy - score, 0.0),
    ]


def maps_table(rows):
    """Return the correlations by scene and by density as a Markdown table."""
    parts = [('all', rows)]
    parts += [(f'{kind} alone', [row for row in rows if row[0] == kind]) for kind in SCENES]
    parts += [(f'1:{ratio} alone', [row for row in rows if row[1] == ratio]) for ratio in RATIOS]
    cells = [(name, len(some), *map(number, correlations(some))) for name, some in parts if some]
    return table(('maps', 'number', 'score', 'mean map entropy'), cells)
