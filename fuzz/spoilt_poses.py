"""Files of poses spoilt: matrices, TUM lines, .g2o, KITTI's numbers, and starts of a rig."""

from pathlib import Path

import numpy as np
from spoilt_parameters import FRAGMENTS
from values import HOSTILE, chance, spoilt_bytes

from idem_ros.commands.main import main as idem

WORDS = ['nan', 'inf', '1e999', '-0', '1e300', 'VERTEX_SE3:QUAT', 'EDGE_SE3:QUAT', '#', ',', '\0']
WORDS += ['99999999999999999999', 'x', '', '\x1b[31m', '\u202e', '1' * 5000, '"', '<', '>', '&x;']
URDF = """<robot name="rig"><link name="a"/><link name="b"/><link name="c"/>
<joint name="ab" type="fixed"><origin xyz="0.1 0 0" rpy="0 0 0.1"/><parent link="a"/>
<child link="b"/></joint><joint name="ac" type="fixed"><origin xyz="0 0.1 0" rpy="0 0 0"/>
<parent link="a"/><child link="c"/></joint></robot>
"""
YAML = 'sensors:\n  b: {parent: a, xyz: [0.1, 0, 0], rpy: [0, 0, 0.1]}\n'
YAML += '  c: {parent: a, matrix: [[1, 0, 0, 0], [0, 1, 0, 0.1], [0, 0, 1, 0], [0, 0, 0, 1]]}\n'


def _w_first(tum):
    """Return a table of other columns than TUM lines have, in another order."""
    rows = [line.split() for line in tum.splitlines()]
    return ''.join(','.join([t, w, *q, x, y, z, '0.1']) + '\n' for t, x, y, z, *q, w in rows)


class Poses:
    """Cases of spoilt poses before every command that reads some.

    Args:
        inputs: a folder with scans.mcap, into which clouds and poses are written whole.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        self._clouds = [str(inputs / f'{name}.npy') for name in 'abc']
        rng, each = np.random.default_rng(0), np.random.default_rng(1).uniform(0, 2, (90, 3))
        for axis, path in enumerate(self._clouds):
            np.save(path, np.where(np.arange(3) == axis, 0.01, 1) * each + rng.normal(0, 0.01, 3))
        self._bag, self._truth = str(inputs / 'scans.mcap'), str(inputs / 'truth.tum')
        assert idem(['truth', self._bag, '--out', self._truth]) == 0
        graph = ['align', *self._clouds, '--voxel-size', 'none', '--out', str(inputs / 'all.g2o')]
        assert idem(graph) in (0, 1)
        tum = Path(self._truth).read_text()
        matrix = '1 0 0 0.01\n0 1 0 0\n0 0 1 0\n0 0 0 1\n'
        self._files = {
            '.g2o': (inputs / 'all.g2o').read_text(),
            '.tum': tum,
            '.txt': matrix * 3,
            '.csv': 'stamp,x,y,z,qx,qy,qz,qw\n' + tum.replace(' ', ','),
            '.named.csv': 'time [s],qw,qx,qy,qz,x,y,z,v\n' + _w_first(tum),
            '.kitti': '1 0 0 0 0 1 0 0 0 0 1 0\n' * 7,
            '.one': matrix,
            '.yaml': YAML,
            '.urdf': URDF,
        }

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        suffix = chance(rng, *self._files)
        name = f'spoilt{suffix}'
        Path(name).write_bytes(_spoilt(rng, self._files[suffix]))
        two, exact = self._clouds[:2], ['--voxel-size', 'none']
        if suffix in ('.yaml', '.urdf'):
            return ['calibrate', *self._clouds, '--start', name, *exact, '--json']
        if suffix in ('.one', '.txt') and rng.random() < 0.7:
            return chance(
                rng,
                ['register', *two, '--guess', name, *exact],
                ['bag', *two, '--guess', name, '--out', 'a.mcap'],
                ['bag', *two, '--truth', name, '--out', 'a.mcap'],
            )
        return chance(
            rng,
            ['align', *self._clouds, '--poses', name, *exact, '--out', 'b.g2o'],
            ['trajectory', self._truth, name],
            ['trajectory', name, self._truth, '--align', '--json'],
            ['smooth', self._bag, '--trajectory', name, '--jobs', '1', '--out', 'out'],
        )


def _spoilt(rng, text):
    if rng.random() < 0.4:
        return spoilt_bytes(rng, text.encode())
    lines = text.splitlines()
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(lines))
        words = lines[at].split(' ')
        value = chance(rng, *WORDS, *FRAGMENTS, *map(repr, HOSTILE))
        words[rng.randrange(len(words))] = value
        lines[at] = chance(rng, ' '.join(words), value, lines[at] + ' ' + value, '')
        if rng.random() < 0.1:
            lines += lines
    return '\n'.join(lines).encode('utf-8', 'backslashreplace')
