"""Clouds as files of every format, spoilt: bytes, words of headers, cells of tables."""

import io
from pathlib import Path

import laspy
import numpy as np
import pye57
from plyfile import PlyData, PlyElement
from pypcd4 import Encoding, PointCloud
from values import HOSTILE, chance, spoilt_bytes

from idem_ros.files.cloud_file import READERS
from idem_ros.files.text_table import read_text

TABLES = [suffix for suffix, reader in READERS.items() if reader is read_text]
WORDS = ['nan', 'inf', '-1', '0', '1e999', '2000000000', '9' * 30, '1.234.567,8', "1'000", '', '"']
WORDS += ['x', '#', '//', ';', ',', '\t', '\r', '\0', '\x1b[31m', '\u202e', '\ufeff', '=1+1', '"x']
WORDS += [
    'list',
    'uint',
    'uchar',
    'property',
    'element',
    'vertex',
    'end_header',
    'format',
    'ascii',
]
WORDS += ['COUNT', 'SIZE', 'TYPE', 'FIELDS', 'POINTS', 'DATA', 'binary', 'x y z', 'F', 'U', '8']
PAGE, CHECKED = 1024, 1020  # [bytes] of E57, of which the last four are the sum of the others
POLYNOMIAL = 0x82F63B78  # of CRC-32C, the lowest bit first


class Clouds:
    """Cases of spoilt clouds before every command that reads some.

    Args:
        inputs: a folder with scans.mcap, into which clouds are written whole.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        self._bag, self._whole = str(inputs / 'scans.mcap'), str(inputs / 'whole.npy')
        points = np.round(np.random.default_rng(2).uniform(0, 2, (120, 3)), 3)
        points[np.arange(120), np.arange(120) % 3] = 0.01
        np.save(self._whole, points)
        self._files = {**_binary(points), '.las': _las(points), '.laz': _las(points, packed=True)}
        self._files['.e57'] = _e57(points, inputs / 'whole.e57')
        assert _summed(self._files['.e57']) == self._files['.e57']

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        suffix, content = self._spoilt(rng)
        name = f'spoilt{suffix}'
        Path(name).write_bytes(content)
        return _arguments(rng, name, self._whole, self._bag)

    def _spoilt(self, rng):
        how = rng.random()
        if how < 0.1:
            return chance(rng, *READERS), rng.randbytes(chance(rng, 0, 1, 12, 227, 600))
        if how < 0.3:
            return chance(rng, *TABLES), _table(rng)
        key = chance(rng, *self._files)
        suffix, content = f'.{key.rpartition(".")[2]}', self._files[key]
        content = _other_words(rng, content) if how < 0.5 else spoilt_bytes(rng, content)
        return suffix, _summed(content) if suffix == '.e57' and rng.random() < 0.8 else content


def _arguments(rng, name, whole, bag):
    exact = ['--voxel-size', 'none']
    words = chance(
        rng,
        ['register', name, whole, *exact],
        ['register', whole, name, *exact, '--json'],
        ['register', name, whole, *exact, '--motion', 'solve'],
        ['bag', whole, name, '--out', 'a.mcap'],
        ['align', whole, name, *exact, '--out', 'b.g2o'],
        ['map', 'tile', name, '--size', '1', '--out', 'tiles'],
        ['replay', bag, '--target-file', name, *exact, '--duration', '0.15'],
    )
    if words[0] not in ('replay', 'align') and rng.random() < 0.25:
        words += ['--columns', chance(rng, '3', '4', '6', '1,2,3', '3,2,1', 'x,y,z', 'y,x,9', '0')]
    return words


def _binary(points):
    """Return {name: bytes} of PLY, PCD, NPY and bare numbers."""
    table = np.rec.fromarrays(points.T.astype('f4'), names=['x', 'y', 'z'])
    files = {}
    for text in (True, False):
        face = np.empty(4, [('i', 'O')])
        face['i'] = [np.arange(k, dtype='i4') for k in (3, 0, 4, 2)]
        elements = [PlyElement.describe(face, 'face'), PlyElement.describe(table, 'vertex')]
        PlyData(elements, text=text).write(stream := io.BytesIO())
        files[f'{text}.ply'] = stream.getvalue()
    for encoding in Encoding:
        cloud = PointCloud.from_xyzi_points(np.c_[points, points[:, 0]])
        cloud.save(stream := io.BytesIO(), encoding)
        files[f'{encoding}.pcd'] = stream.getvalue()
    for key, array in {'rows.npy': points, 'fields.npy': table, 'turned.npy': points.T}.items():
        np.save(stream := io.BytesIO(), array)
        files[key] = stream.getvalue()
    np.savez_compressed(stream := io.BytesIO(), points=points, colors=points)
    files['many.npz'] = stream.getvalue()
    pose = '12\n10\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n'
    rows = ''.join(f'{x} {y} {z} 0.5\n' for x, y, z in points.tolist())
    files['scan.ptx'] = (pose + rows).encode()
    for kind in ('<f4', '<f8'):
        files[f'{kind}.bin'] = np.c_[points, points[:, 0] > 0].astype(kind).tobytes()
    return files


def _las(points, packed=False):
    las = laspy.create(point_format=3, file_version='1.4' if packed else '1.2')
    las.header.scales = (0.001,) * 3
    las.x, las.y, las.z = points.T
    las.write(stream := io.BytesIO(), do_compress=packed)
    return stream.getvalue()


def _e57(points, path):
    with pye57.E57(str(path), mode='w') as file:
        file.write_scan_raw({f'cartesian{axis}': points[:, k] for k, axis in enumerate('XYZ')})
    return path.read_bytes()


def _summed(content):
    """Return the bytes of an E57 with the sums of its pages made right."""
    pages = bytearray(content)
    for end in range(CHECKED, len(pages) - 3, PAGE):
        crc = 0xFFFFFFFF
        for byte in pages[end - CHECKED : end]:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ (POLYNOMIAL if crc & 1 else 0)
        pages[end : end + 4] = (crc ^ 0xFFFFFFFF).to_bytes(4, 'big')
    return bytes(pages)


def _other_words(rng, content):
    """Return bytes in which some words of a header, or of whatever reads as one, are others."""
    separator = chance(rng, b' ', b' ', b'\n', b"'", b'"')
    head, rest = content[:4000], content[4000:]
    words = head.split(separator)
    for _ in range(chance(rng, 1, 1, 2)):
        new = chance(rng, *WORDS, str(rng.randrange(2 ** chance(rng, 4, 16, 40)))).encode()
        at = rng.randrange(len(words))
        if rng.random() < 0.7:
            words[at] = new
        else:
            words[at:at] = [new] * chance(rng, 1, 2, 50)
    return separator.join(words) + rest


def _table(rng):
    """Return a table of one delimiter and decimal sign, some of whose cells are others."""
    delimiter, decimal = chance(rng, ',', ';', '\t', ' ', '  ', '|'), chance(rng, '.', '.', ',')
    width = chance(rng, 2, 3, 3, 3, 4, 6, 7)
    rows = [[f'{rng.gauss(0, 5):.3f}' for _ in range(width)] for _ in range(chance(rng, 1, 5, 90))]
    if rng.random() < 0.5:
        names = [*'xyz', 'intensity', 'r', 'g', 'b']
        rows.insert(0, chance(rng, names, [*'XYZ'] * 3, names[::-1], [*'012345'])[:width])
    if rng.random() < 0.2:
        rows.insert(0, [chance(rng, str(len(rows)), '90', '# made by', 'sep=;', '2000000000')])
    for _ in range(chance(rng, 0, 1, 1, 2)):
        row = chance(rng, *rows)
        new = chance(rng, *WORDS, *map(repr, HOSTILE))
        how, at = rng.random(), rng.randrange(len(row) or 1)
        row[at : at + (how < 0.7)] = [new] if how < 0.9 else []
    end = chance(rng, '\n', '\n', '\r\n', '\r')
    text = end.join(delimiter.join(row) for row in rows).replace('.', decimal)
    coding = chance(rng, *['utf-8'] * 6, 'utf-16', 'utf-8-sig', 'utf-32')
    content = text.encode(coding, 'backslashreplace')
    return spoilt_bytes(rng, content) if rng.random() < 0.2 else content
