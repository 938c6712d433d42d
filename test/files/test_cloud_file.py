import numpy as np
import pytest
from plyfile import PlyData, PlyElement, PlyListProperty
from pypcd4 import Encoding, PointCloud

from idem_ros.files.cloud_file import READERS, UnreadableCloud, read_cloud


@pytest.fixture
def points(rng):
    return rng.normal(size=(40, 3)).astype(np.float32).astype(np.float64)


def write_ply(path, points, text, dtype='f4'):
    vertices = np.empty(len(points), dtype=[('q', 'u1'), ('x', dtype), ('y', dtype), ('z', dtype)])
    vertices['q'] = 7
    for axis, name in enumerate('xyz'):
        vertices[name] = points[:, axis]
    grid = np.empty(2, dtype=[('indices', object)])
    grid['indices'] = [np.array([1, 2], 'i4'), np.array([], 'i4')]
    elements = [
        PlyElement.describe(vertices, 'vertex'),
        PlyElement.describe(grid, 'range_grid', len_types={'indices': 'u1'}),
    ]
    assert isinstance(elements[1].properties[0], PlyListProperty)
    PlyData(elements, text=text).write(path)


@pytest.mark.parametrize(('text', 'dtype'), [(True, 'f8'), (False, 'f4'), (False, 'f8')])
def test_reads_ply(tmp_path, points, text, dtype):
    write_ply(tmp_path / 'scan.ply', points, text, dtype)
    np.testing.assert_array_equal(read_cloud(tmp_path / 'scan.ply'), points)


def test_reads_ascii_ply_with_lines_that_end_as_on_windows(tmp_path, points):
    path = tmp_path / 'scan.ply'
    write_ply(path, points, text=True, dtype='f8')
    path.write_bytes(path.read_bytes().replace(b'\n', b'\r\n'))
    np.testing.assert_array_equal(read_cloud(path), points)


@pytest.mark.parametrize('encoding', list(Encoding))
def test_reads_pcd(tmp_path, points, encoding):
    path = tmp_path / 'scan.pcd'
    PointCloud.from_xyzi_points(np.c_[points, np.ones(len(points))]).save(path, encoding)
    np.testing.assert_allclose(read_cloud(path), points, rtol=1e-6)


def test_reads_pcd_of_an_old_version_without_viewpoint(tmp_path):
    (tmp_path / 'old.pcd').write_text(
        '# .PCD v.5\nVERSION .5\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n'
        'WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n'
    )
    np.testing.assert_array_equal(read_cloud(tmp_path / 'old.pcd'), [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    'text',
    [
        '1 2 3\n4 5 6\n',
        '1 2 3 0.5\n4 5 6 0.5',
        '   1e0   2e0\t3.0\r\n   4   5   6\r\n',
        '1,2,3\n4,5,6\n',
        'x,y,z,nx\n1 , 2 , 3 , 9\n4 , 5 , 6 , 9\n',
        'time;Z;Y;X\n0;3;2;1\n0;6;5;4\n',
        '\ufeff"x","y","z"\n1,2,3\n4,5,6\n',
        '# a comment\n\n// and a header\n1 2 3\n4 5 6\n',
    ],
)
@pytest.mark.parametrize('suffix', ['.xyz', '.txt', '.csv'])
def test_reads_text_with_any_separators_and_header(tmp_path, text, suffix):
    path = tmp_path / f'scan{suffix}'
    path.write_text(text, encoding='utf-8', newline='')
    np.testing.assert_array_equal(read_cloud(path), [[1, 2, 3], [4, 5, 6]])


def test_reads_kitti(tmp_path, points):
    np.c_[points, np.ones(len(points))].astype('<f4').tofile(tmp_path / '000000.bin')
    np.testing.assert_array_equal(read_cloud(tmp_path / '000000.bin'), points)


@pytest.mark.parametrize('dtype', ['f4', '>f8', 'i4'])
def test_reads_npy(tmp_path, points, dtype):
    array = np.c_[points * 100, np.ones(len(points))].astype(dtype)
    np.save(tmp_path / 'scan.npy', array)
    np.testing.assert_array_equal(read_cloud(tmp_path / 'scan.npy'), array[:, :3])


def test_reads_npy_with_named_fields(tmp_path):
    np.save(tmp_path / 'scan.npy', np.array([(1, 2, 3)], dtype=[(n, 'f4') for n in 'zyx']))
    np.testing.assert_array_equal(read_cloud(tmp_path / 'scan.npy'), [[3, 2, 1]])


@pytest.mark.parametrize('shape', [(3, 100), (2, 2), (5,), (2, 3, 3)])
def test_an_array_of_another_shape_is_refused(tmp_path, shape):
    np.save(tmp_path / 'scan.npy', np.ones(shape))
    with pytest.raises(UnreadableCloud, match=r'must be \(N, 3\)'):
        read_cloud(tmp_path / 'scan.npy')


def test_the_suffix_may_be_in_capitals(tmp_path):
    (tmp_path / 'SCAN.XYZ').write_text('1 2 3\n')
    assert len(read_cloud(tmp_path / 'SCAN.XYZ')) == 1


def test_points_that_are_not_finite_are_left_out_with_a_warning(tmp_path, caplog):
    (tmp_path / 'scan.xyz').write_text('1 2 3\nnan 1 1\n1 inf 1\n4 5 6\n')
    np.testing.assert_array_equal(read_cloud(tmp_path / 'scan.xyz'), [[1, 2, 3], [4, 5, 6]])
    assert 'of 4 points 2 are not finite' in caplog.text


def test_coordinates_beyond_any_measurement_are_left_out_too(tmp_path, caplog):
    np.save(tmp_path / 'scan.npy', [[1, 2, 3], [1e300, 2, 3], [1, -1e12, 3], [4, 5, 6]])
    np.testing.assert_array_equal(read_cloud(tmp_path / 'scan.npy'), [[1, 2, 3], [4, 5, 6]])
    assert 'of 4 points 2 are not finite' in caplog.text


def test_several_exact_zeros_are_padding_and_one_is_a_point(tmp_path, caplog):
    (tmp_path / 'one.xyz').write_text('0 0 0\n1 2 3\n')
    (tmp_path / 'two.xyz').write_text('0 0 0\n1 2 3\n0 0 -0\n')
    assert len(read_cloud(tmp_path / 'one.xyz')) == 2
    assert caplog.text == ''
    assert len(read_cloud(tmp_path / 'two.xyz')) == 1
    assert '2 exactly zero' in caplog.text


@pytest.mark.parametrize('suffix', READERS)
@pytest.mark.parametrize('content', [b'', b'\x00\xff garbage \xfe', b'x y\n1 2\n'])
def test_what_is_no_cloud_is_refused_in_one_line_with_its_name(tmp_path, suffix, content):
    path = tmp_path / f'broken{suffix}'
    path.write_bytes(content)
    with pytest.raises(UnreadableCloud) as refused:
        read_cloud(path)
    assert str(path) in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    'write',
    [
        lambda path, points: write_ply(path.with_suffix('.ply'), points, text=False),
        lambda path, points: write_ply(path.with_suffix('.ply'), points, text=True),
        lambda path, points: np.save(path.with_suffix('.npy'), points),
        lambda path, points: np.c_[points, points].astype('f4').tofile(path.with_suffix('.bin')),
        *(
            lambda path, points, encoding=encoding: PointCloud.from_xyz_points(points).save(
                path.with_suffix('.pcd'), encoding
            )
            for encoding in Encoding
        ),
    ],
)
def test_a_file_that_is_cut_off_is_refused(tmp_path, points, write):
    write(tmp_path / 'scan', points)
    (path,) = tmp_path.iterdir()
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3 - 1])
    with pytest.raises(UnreadableCloud, match='scan'):
        read_cloud(path)


def test_a_binary_pcd_that_is_cut_off_between_two_points_is_refused(tmp_path, points):
    path = tmp_path / 'scan.pcd'
    PointCloud.from_xyz_points(points).save(path, Encoding.BINARY)
    path.write_bytes(path.read_bytes()[: -5 * 12])
    with pytest.raises(UnreadableCloud, match='35 points where the header says 40'):
        read_cloud(path)


def test_no_pickle_is_opened(tmp_path):
    np.save(tmp_path / 'scan.npy', np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(UnreadableCloud, match='scan.npy'):
        read_cloud(tmp_path / 'scan.npy')


def test_a_missing_file_a_folder_and_an_unknown_suffix_are_refused(tmp_path):
    with pytest.raises(UnreadableCloud, match='nowhere.ply cannot be read: No such file'):
        read_cloud(tmp_path / 'nowhere.ply')
    (tmp_path / 'folder.npy').mkdir()
    with pytest.raises(UnreadableCloud, match='folder.npy is a folder; it must be a cloud file'):
        read_cloud(tmp_path / 'folder.npy')
    with pytest.raises(UnreadableCloud, match=r'its suffix must be one of \.ply, \.pcd'):
        read_cloud(tmp_path / 'mesh.stl')


def test_a_cloud_without_a_usable_point_is_refused(tmp_path):
    (tmp_path / 'nan.xyz').write_text('nan nan nan\n')
    with pytest.raises(UnreadableCloud, match='1 points and none is usable'):
        read_cloud(tmp_path / 'nan.xyz')


@pytest.mark.parametrize(
    ('name', 'count'),
    [
        ('stanford_bunny/data/bun000.ply', 40_256),
        ('stanford_bunny/reconstruction/bun_zipper_res3.ply', 1_889),
        ('3dmatch_redkitchen/cloud_bin_0.ply', 258_342),
        ('cross_source/threechair/kinect.ply', 57_625),
        ('small_gicp/target.ply', 69_088 - 5_032),
        ('fast_gicp/251370668.pcd', 69_088 - 5_032),
        ('pcl_bunny_397/bunny.pcd', 397),
        ('pcl_tutorials/room_scan1.pcd', 112_586),
        ('libpointmatcher_car/car_cloud400.csv', 24_989),
        ('libpointmatcher_car/car_cloud401.csv', 25_193),
        ('simpleicp/dragon1.xyz', 100_000),
        ('kitti_odometry_07/0000000000.bin', 122_626),
    ],
)
def test_reads_real_clouds(shared_data, name, count):
    cloud = read_cloud(shared_data / name)
    assert cloud.shape == (count, 3)
    assert np.ptp(cloud, axis=0).min() > 0


def test_the_same_cloud_is_the_same_in_ply_and_pcd(shared_data):
    np.testing.assert_array_equal(
        read_cloud(shared_data / 'small_gicp/source.ply'),
        read_cloud(shared_data / 'fast_gicp/251371071.pcd'),
    )
