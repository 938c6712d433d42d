"""A map on disk, in one file and in tiles: time to a result, and memory, in fresh processes."""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks import CHECKOUT
from benchmarks.footprint import resident_and_peak
from benchmarks.goal import Goal
from benchmarks.maps.town import Town
from idem_ros.core import MapCloud, RegistrationConfig, register, warm_up
from idem_ros.files.pcd_file import write_pcd
from idem_ros.maps.open_map import open_map
from idem_ros.maps.tile_writer import cut_map

FILE, TILES = 'town.pcd', 'tiles'
TILE = 100.0  # [m]
FIRST_S, OTHER_S, BYTES_A_POINT, TILES_MB = 5.0, 1.0, 150.0, 1500.0


@dataclass(frozen=True)
class FromDisk:
    """What a map on disk took.

    Attributes:
        form: file or tiles.
        points: of the map.
        first_s, other_s: from the map on disk to the result of a scan in it, and from there to
            that of a scan in another place [s].
        bytes: by which the most memory that was resident exceeds that without a map.
        worst_m: the larger error of the two results [m].
    """

    form: str
    points: int
    first_s: float
    other_s: float
    bytes: int
    worst_m: float


def measure(millions, scans, config):
    """Return `FromDisk` of a file and of tiles of a town.

    Args:
        millions: of points, about.
        scans: two pairs of points (N, 3) and their exact pose.
        config: `RegistrationConfig`.
    """
    with tempfile.TemporaryDirectory(prefix='idem_bench_') as name:
        folder = Path(name)
        town = Town(1e6 * millions)
        points = town.points_within(*town.bounds)
        write_pcd(folder / FILE, points)
        cut_map(folder / FILE, folder / TILES, TILE)
        for k, (scanned, truth) in enumerate(scans):
            np.savez(folder / f'{k}.npz', points=scanned, truth=truth)
        return [_fresh(folder, form, len(points), config) for form in (FILE, TILES)]


def goals(found):
    """Return the figures to reach, as `Goal`s, of what `measure` returned."""
    file, tiles = found
    points = f'{file.points / 1e6:.3g} million points'
    yield Goal(f'from a file of {points} to the first result', file.first_s, FIRST_S, 's')
    yield Goal('from there to a result in another place', file.other_s, OTHER_S, 's')
    a_point = file.bytes / file.points
    yield Goal('resident memory a point of the file', a_point, BYTES_A_POINT, 'bytes')
    yield Goal('resident memory with tiles', tiles.bytes / 1e6, TILES_MB, 'MB')


def _fresh(folder, form, points, config):
    command = [sys.executable, '-m', 'benchmarks.maps.from_disk', str(folder), form]
    command += [str(config.voxel_size), str(config.threads)]
    ended = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=True)
    return FromDisk(form, points, **json.loads(ended.stdout))


def _in_this_process(folder, form, voxel_size, threads):
    config = RegistrationConfig(voxel_size=float(voxel_size), threads=int(threads))
    config = replace(config, assessment='verdict')
    scans = [np.load(Path(folder) / f'{k}.npz') for k in range(2)]
    clouds = [(scan['points'], scan['truth']) for scan in scans]
    warm_up()
    before, _ = resident_and_peak()
    seconds, errors = [], []
    begin = perf_counter()
    map_ = MapCloud(open_map(str(Path(folder) / form)))
    for points, truth in clouds:
        result = register(map_, points, truth, config)
        seconds.append(perf_counter() - begin)
        errors.append(float(np.linalg.norm(result.T_target_source[:3, 3] - truth[:3, 3])))
        begin = perf_counter()
    taken = resident_and_peak()[1] - before
    return dict(first_s=seconds[0], other_s=seconds[1], bytes=taken, worst_m=max(errors))


if __name__ == '__main__':
    print(json.dumps(_in_this_process(*sys.argv[1:])))
