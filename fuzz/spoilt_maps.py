"""Maps spoilt: tiles and their metadata, and clouds of one file."""

import io
import shutil
from pathlib import Path

import laspy
import numpy as np
from spoilt_parameters import FRAGMENTS
from values import EXTREMES, HOSTILE, chance, spoilt_bytes

from idem_ros.commands.main import main as idem
from idem_ros.maps.tile_index import METADATA

NAMES = ['..', '.', '/dev/zero', '../scans.mcap', '0_0.pcd', 'a.ply', '"\\0.pcd"', 'x' * 300, '7']


class Maps:
    """Cases of spoilt maps, that are cut into tiles or that scans are looked for in.

    Args:
        inputs: a folder with scans.mcap, into which they are written whole.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        points = np.random.default_rng(0).uniform(-3, 3, (900, 3))
        np.savetxt(inputs / 'map.xyz', points)
        self._tiles, self._bag = inputs / 'tiles', str(inputs / 'scans.mcap')
        whole = ['map', 'tile', str(inputs / 'map.xyz'), '--size', '3', '--out', str(self._tiles)]
        assert idem(whole) == 0
        self._metadata = (self._tiles / METADATA).read_text()
        self._files = {'.pcd': next(self._tiles.glob('*.pcd')).read_bytes()}
        self._files['.xyz'] = (inputs / 'map.xyz').read_bytes()
        self._files['.las'] = self._files['.laz'] = _las(points)
        self._files['.npy'] = _npy(points)
        self._files['.ply'] = _ply(points)

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        if rng.random() < 0.6:
            name = 'tiles'
            shutil.copytree(self._tiles, name)
            if rng.random() < 0.7:
                (Path(name) / METADATA).write_bytes(self._spoilt_metadata(rng))
            else:
                tile = chance(rng, *sorted(Path(name).glob('*.pcd')))
                tile.write_bytes(spoilt_bytes(rng, tile.read_bytes()))
        else:
            suffix = chance(rng, *self._files)
            name = f'map{suffix}'
            Path(name).write_bytes(spoilt_bytes(rng, self._files[suffix]))
        if rng.random() < 0.5:
            size = chance(rng, '1', '3', '100', '1000000')
            return ['map', 'tile', name, '--size', size, '--out', 'out']
        voxels = chance(rng, 'auto', '0.2', 'none')
        return ['replay', self._bag, '--target-file', name, '--voxel-size', voxels]

    def _spoilt_metadata(self, rng):
        if rng.random() < 0.3:
            return spoilt_bytes(rng, self._metadata.encode())
        lines = self._metadata.splitlines()
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(lines))
            name, _, corner = lines[at].partition(':')
            value = chance(rng, *FRAGMENTS, *map(repr, HOSTILE))
            number = chance(rng, *EXTREMES, 1e12, -1e12, 0.5)
            lines[at] = chance(
                rng,
                f'{name}: {value}',
                f'{chance(rng, *NAMES)}:{corner}',
                f'{name}: [{number}, {value}]',
                f'{name}: {number}',
                f'{name}: [{number}, {number}]',
                value,
            )
        return '\n'.join(lines).encode('utf-8', 'backslashreplace')


def _las(points):
    las = laspy.create(point_format=0, file_version='1.2')
    las.header.scales = (0.001,) * 3
    las.x, las.y, las.z = points.T
    stream = io.BytesIO()
    las.write(stream)
    return stream.getvalue()


def _npy(points):
    stream = io.BytesIO()
    np.save(stream, points)
    return stream.getvalue()


def _ply(points):
    head = f'ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n'
    head += ''.join(f'property float {axis}\n' for axis in 'xyz') + 'end_header\n'
    return head.encode() + points.astype('<f4').tobytes()
