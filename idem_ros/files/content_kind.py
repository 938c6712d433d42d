"""What a file plainly is by its first bytes, whatever its name says."""

from idem_ros.files.unreadable import UnreadableCloud

PACKED = ('.gz', '.bz2', '.xz', '.zst', '.zip', '.7z', '.rar', '.tar', '.tgz')
UNPACK = 'unpack it first, and give what is in it'
LONGEST = 64  # [bytes]
KINDS = (  # how it begins, in small letters; the suffixes that it may have; what it is
    (b'\x1f\x8b\x08', (), f'packed by gzip; {UNPACK}'),
    (b'bzh91ay&sy', (), f'packed by bzip2; {UNPACK}'),
    (b'\xfd7zxz\x00', (), f'packed by xz; {UNPACK}'),
    (b'\x28\xb5\x2f\xfd', (), f'packed by zstd; {UNPACK}'),
    (b'7z\xbc\xaf\x27\x1c', (), f'packed by 7-Zip; {UNPACK}'),
    (b'pk\x03\x04', ('.npz',), f'packed by zip, as Excel and NumPy do; {UNPACK}, or name it .npz'),
    (b'ply\n', ('.ply',), 'a PLY; its name must end in .ply'),
    (b'ply\r', ('.ply',), 'a PLY; its name must end in .ply'),
    (b'# .pcd ', ('.pcd',), 'a PCD; its name must end in .pcd'),
    (b'lasf', ('.las', '.laz'), 'a LAS; its name must end in .las or .laz'),
    (b'astm-e57', ('.e57',), 'an E57; its name must end in .e57'),
    (b'\x93numpy', ('.npy',), 'an array of NumPy; its name must end in .npy'),
    (b'\x89mcap', (), 'a recording, which idem replay reads'),
    (b'#rosbag', (), 'a recording of ROS 1, which idem replay reads'),
    (b'\x89hdf', (), 'an HDF5, which is not read; its points must be written as .npy or .ply'),
    (b'matlab 5.0 mat', (), 'a MAT, which is not read; writematrix makes a table of its points'),
    (b'solid ', (), 'a mesh (STL), which is not read; its points must be written as .ply'),
    (b'ncols', (), 'a grid of heights (Esri), which is not read; its cells must be rows x y z'),
    (b'# vtk ', (), 'a VTK, which is not read; its points must be written as .ply or .csv'),
    (b'<!doctype', (), 'a page of the web, perhaps of an error: it must be fetched again'),
    (b'<html', (), 'a page of the web, perhaps of an error: it must be fetched again'),
    (b'version https://git-lfs', (), 'only where Git LFS has the file; git lfs pull gets it'),
)


def refuse_other_kind(path):
    """Refuse a file whose first bytes say that it is not what its suffix says.

    Raises:
        UnreadableCloud: it says what it is, and what to do.
    """
    with path.open('rb') as stream:
        begin = stream.read(LONGEST).removeprefix(b'\xef\xbb\xbf').lower()
    for sign, suffixes, what in KINDS:
        if begin.startswith(sign) and path.suffix.lower() not in suffixes:
            raise UnreadableCloud(f'by its content it is {what}')
