from shutil import copy

import numpy as np
import pytest
from scans_in_files import scans, write_kitti_sequence, write_numbered

from idem_ros.core import IdemError
from idem_ros.files.cloud_file import read_cloud
from idem_ros.files.scan_folder import START, STEP, read_scan_folder

STAMPS = [5 * 10**9, 5_200_000_000, 5_300_000_001, 5_400_000_000]


@pytest.fixture
def kitti(tmp_path, rng):
    poses, clouds = scans(rng)
    write_kitti_sequence(tmp_path / 'drive', rng, poses, clouds)
    return tmp_path / 'drive'


@pytest.fixture
def numbered(tmp_path, rng):
    write_numbered(tmp_path / 'scans', *scans(rng), STAMPS)
    return tmp_path / 'scans'


def test_poses_of_kitti_are_brought_from_the_camera_to_the_lidar(kitti):
    poses, clouds = scans(np.random.default_rng(0))
    folder = read_scan_folder(kitti)
    np.testing.assert_allclose(folder.poses, poses, atol=1e-12)
    assert folder.stamps == tuple(START + STEP * k for k in range(4))
    for scan, cloud in zip(folder.scans, clouds, strict=True):
        np.testing.assert_array_equal(read_cloud(scan), cloud)


def test_the_layout_of_the_benchmark_has_poses_in_a_folder_of_their_own(
    tmp_path, rng, monkeypatch
):
    poses, clouds = scans(rng)
    (tmp_path / 'poses').mkdir()
    sequence = tmp_path / 'sequences' / '07'
    write_kitti_sequence(sequence, rng, poses, clouds, tmp_path / 'poses' / '07.txt')
    np.testing.assert_allclose(read_scan_folder(sequence).poses, poses, atol=1e-12)
    monkeypatch.chdir(sequence)
    np.testing.assert_allclose(read_scan_folder('.').poses, poses, atol=1e-12)


def test_numbered_scans_come_in_the_order_of_their_numbers_with_the_stamps_of_the_poses(numbered):
    poses, clouds = scans(np.random.default_rng(0))
    folder = read_scan_folder(numbered, numbered / 'poses.tum')
    names = ['scan_2.ply', 'scan_10.ply', 'scan_18.ply', 'scan_26.ply']
    assert [scan.name for scan in folder.scans] == names
    assert folder.stamps == tuple(STAMPS)
    np.testing.assert_allclose(folder.poses, poses, atol=1e-11)
    np.testing.assert_array_equal(read_cloud(folder.scans[1]), clouds[1])


@pytest.mark.parametrize('suffix', ['.csv', '.txt', '.pts', '.npy', '.pcd.bin', '.xyz'])
def test_scans_may_be_of_any_format_that_is_read(tmp_path, numbered, suffix, caplog):
    clouds = [
        read_cloud(scan) for scan in read_scan_folder(numbered, numbered / 'poses.tum').scans
    ]
    other = tmp_path / 'other'
    other.mkdir()
    for k, cloud in enumerate(clouds):
        path = other / f'scan_{k:03d}{suffix}'
        if suffix == '.npy':
            np.save(path, cloud)
        elif suffix == '.pcd.bin':
            np.c_[cloud, np.zeros((len(cloud), 2))].astype('<f4').tofile(path)
        else:
            np.savetxt(path, cloud, delimiter=',', header='x,y,z')
    copy(numbered / 'poses.tum', other / 'poses.txt')
    (other / 'readme.txt').write_text('no scan\n')
    found = read_scan_folder(other, other / 'poses.txt')
    assert len(found.scans) == 4
    for scan, cloud in zip(found.scans, clouds, strict=True):
        np.testing.assert_allclose(read_cloud(scan), cloud, atol=1e-6)
    assert 'not numbered, so no scans: readme.txt' in caplog.text


def test_names_that_are_stamps_are_numbers(numbered):
    for old, new in ((2, '9.95'), (10, '10.05'), (18, '10.1'), (26, '11')):
        (numbered / f'scan_{old}.ply').rename(numbered / f'{new}.ply')
    scans = read_scan_folder(numbered, numbered / 'poses.tum').scans
    assert [scan.stem for scan in scans] == ['9.95', '10.05', '10.1', '11']


def without(*names):
    def change(folder):
        for name in names:
            (folder / name).unlink()

    return change


def text_in(name, text):
    return lambda folder: (folder / name).write_text(text)


def copied(old, new):
    return lambda folder: copy(folder / old, folder / new)


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (without('calib.txt'), 'has no calib.txt; its line "Tr:"'),
        (text_in('calib.txt', 'P0: 1 2 3\n'), 'must hold one line "Tr:"'),
        (text_in('calib.txt', 'Tr: 1 2 3\n'), 'must hold one line "Tr:"'),
        (text_in('calib.txt', f'Tr: {"2 " * 12}\n'), 'Tr is not rigid'),
        (without('poses.txt'), 'has no poses: neither'),
        (text_in('poses.txt', '1 0 0 0 0 1 0 0 0 0 1 0\n'), 'holds 4 scans, but there are 1'),
        (text_in('poses.txt', '1 0 0\n'), 'poses.txt, line 1 is no pose'),
        (without('velodyne/000001.bin'), 'holds 3 scans, but there are 4 poses in'),
        (copied('velodyne/000001.bin', 'velodyne/last.bin'), 'last.bin is not numbered'),
        (copied('velodyne/000001.bin', 'velodyne/1.bin'), 'have the same number'),
        (without(*(f'velodyne/00000{k}.bin' for k in range(4))), 'holds no cloud'),
    ],
)
def test_a_sequence_that_lacks_a_part_is_refused_in_one_line(kitti, change, words):
    change(kitti)
    with pytest.raises(IdemError) as refused:
        read_scan_folder(kitti)
    assert words in str(refused.value)
    assert str(kitti) in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (copied('scan_2.ply', 'scan_2_filtered.ply'), 'scan_2_filtered.ply is not numbered'),
        (copied('scan_2.ply', 'scan_34.ply'), 'holds 5 scans, but there are 4 poses in'),
        (without('poses.tum'), 'poses.tum cannot be read'),
        (text_in('poses.tum', '1 0 0 0 0 0 0 1\n2 0 0 0\n'), 'poses.tum, line 2'),
    ],
)
def test_numbered_scans_without_their_poses_are_refused(numbered, change, words):
    change(numbered)
    with pytest.raises(IdemError) as refused:
        read_scan_folder(numbered, numbered / 'poses.tum')
    assert words in str(refused.value)


def test_a_folder_of_clouds_without_a_trajectory_is_told_how(numbered):
    with pytest.raises(IdemError, match='name the file of their poses with --trajectory'):
        read_scan_folder(numbered)


def test_one_scan_is_no_pair(tmp_path, rng):
    poses, clouds = scans(rng, count=1)
    write_numbered(tmp_path / 'scans', poses, clouds, STAMPS[:1])
    with pytest.raises(IdemError, match='a pair takes two'):
        read_scan_folder(tmp_path / 'scans', tmp_path / 'scans' / 'poses.tum')
