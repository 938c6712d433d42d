"""Files that are not what their names say."""

import bz2
import gzip
import lzma

import numpy as np
import pytest

from idem_ros.files.cloud_file import READERS, UnreadableCloud, read_cloud

LFS = b'version https://git-lfs.github.com/spec/v1\noid sha256:0a\nsize 9\n'
PACKED = {'gzip': gzip.compress, 'bzip2': bz2.compress, 'xz': lzma.compress}


def content_of(tmp_path, suffix):
    """Bytes of a cloud of some format."""
    path = tmp_path / f'whole{suffix}'
    points = np.arange(60.0).reshape(20, 3) * 0.7 % 5.0
    if suffix == '.npy':
        np.save(path, points)
    elif suffix == '.npz':
        np.savez(path, points)
    elif suffix == '.ply':
        names = ''.join(f'property float {axis}\n' for axis in 'xyz')
        path.write_text(f'ply\nformat ascii 1.0\nelement vertex 20\n{names}end_header\n')
        with path.open('ab') as stream:
            np.savetxt(stream, points)
    elif suffix == '.pcd':
        path.write_text('# .PCD v0.7\nFIELDS x y z\nWIDTH 20\nHEIGHT 1\nDATA ascii\n')
        with path.open('ab') as stream:
            np.savetxt(stream, points)
    read_cloud(path)
    return path.read_bytes()


@pytest.mark.parametrize('suffix', ['.npy', '.npz', '.ply', '.pcd'])
@pytest.mark.parametrize('named', READERS)
def test_a_cloud_under_the_name_of_another_format_is_told_by_its_content(tmp_path, suffix, named):
    (tmp_path / f'a{named}').write_bytes(content_of(tmp_path, suffix))
    if named == suffix:
        assert read_cloud(tmp_path / f'a{named}').shape == (20, 3)
        return
    with pytest.raises(UnreadableCloud, match=rf'by its content it is .*\{suffix}'):
        read_cloud(tmp_path / f'a{named}')


@pytest.mark.parametrize('named', ['.csv', '.bin', '.ply', '.npy'])
@pytest.mark.parametrize('how', PACKED)
def test_a_packed_file_is_told_whatever_its_name(tmp_path, named, how):
    (tmp_path / f'a{named}').write_bytes(PACKED[how](b'1 2 3\n' * 20))
    with pytest.raises(UnreadableCloud, match=f'packed by {how}; unpack it first'):
        read_cloud(tmp_path / f'a{named}')


@pytest.mark.parametrize('name', ['a.csv.gz', 'a.PLY.GZ', 'a.zip', 'a.tar', 'a.pcd.zst'])
def test_a_name_of_a_packed_file_is_told_what_to_do(tmp_path, name):
    (tmp_path / name).write_bytes(b'1 2 3\n' * 20)
    with pytest.raises(UnreadableCloud, match='unpack it first'):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize(
    ('content', 'words'),
    [
        (LFS, 'git lfs pull'),
        (b'<!DOCTYPE html>\n<html><head>', 'a page of the web'),
        (b'\xef\xbb\xbf<html>', 'a page of the web'),
        (b'NCOLS 4\nNROWS 5\nXLLCORNER 0\nYLLCORNER 0\nCELLSIZE 1\n' + b'1 2 3 4\n' * 5, 'Esri'),
        (b'# vtk DataFile Version 3.0\nscan\nASCII\nDATASET POLYDATA\n', 'a VTK'),
        (b'solid part\nfacet normal 0 0 1\n', 'a mesh'),
        (b'\x89MCAP0\r\n\x01', 'idem replay'),
        (b'MATLAB 5.0 MAT-file, Platform: PCWIN64', 'writematrix'),
    ],
)
@pytest.mark.parametrize('named', ['.asc', '.txt', '.bin', '.pcd', '.las'])
def test_what_is_no_cloud_at_all_is_told_what_it_is(tmp_path, content, words, named):
    (tmp_path / f'a{named}').write_bytes(content)
    with pytest.raises(UnreadableCloud, match=words):
        read_cloud(tmp_path / f'a{named}')
