import json
from pathlib import Path

import numpy as np
import pytest
from clouds import motion
from drives import drive, stamps_of, write_drive

from idem_ros.commands.main import main
from idem_ros.evaluation import worker_processes
from idem_ros.files.cloud_file import read_cloud
from idem_ros.files.pose_file import read_poses, write_tum
from idem_ros.files.trajectory_file import read_trajectory

FILES = {'trajectory.tum', 'graph.g2o', 'covariances.csv', 'map.pcd', 'smooth.json'}
ASK = ['smooth', 'drive.mcap', '--trajectory', 'drive.tum', '--out', 'out', '--jobs', '1']
KEYFRAMES = ['--keyframe-distance', '0.3', '--voxel-size', '0.1']


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """A folder with a drive, and its true poses."""
    folder = tmp_path_factory.mktemp('drive')
    clouds, truth, odometry = drive(np.random.default_rng(0), points=1500)
    write_drive(folder, clouds, odometry)
    return folder, truth


@pytest.fixture
def here(made, monkeypatch, tmp_path):
    """A working folder in which the drive is."""
    folder, truth = made
    for name in ('drive.mcap', 'drive.tum'):
        (tmp_path / name).symlink_to(folder / name)
    monkeypatch.chdir(tmp_path)
    return truth


def test_the_trajectory_is_nearer_the_truth_and_all_files_are_there(here, capsys):
    Path('loops.txt').write_text('# first and last\n1.0 2.5\n')
    assert main([*ASK, *KEYFRAMES, '--loops', 'loops.txt']) == 0
    out = capsys.readouterr().out
    assert '16 scans, 16 keyframes on voxels of 0.1 m' in out
    assert '| smoothed |' in out
    assert {path.name for path in Path('out').iterdir()} == FILES
    found, given = (read_trajectory(name) for name in ('out/trajectory.tum', 'drive.tum'))
    np.testing.assert_array_equal(found.stamps, stamps_of(16))
    off, before = (
        np.linalg.norm(each.poses[:, :3, 3] - here[:, :3, 3], axis=1) for each in (found, given)
    )
    assert off.max() < before.max() / 2
    record = json.loads(Path('out/smooth.json').read_text())
    assert record['map']['smoothed']['score'] < record['map']['as_given']['score']
    assert any((each['i'], each['j']) == (0, 15) for each in record['relations'])
    assert len(read_poses('out/graph.g2o', 16)) == 16
    assert len(Path('out/covariances.csv').read_text().splitlines()) == 17
    points = read_cloud('out/map.pcd')
    assert len(points) == record['map']['points']


def test_a_recording_that_the_trajectory_covers_in_part_is_done_in_part(here, capsys):
    stamps, poses = stamps_of(16), read_trajectory('drive.tum').poses
    write_tum('part.tum', stamps[4:8], poses[4:8])
    ask = ['part.tum' if each == 'drive.tum' else each for each in ASK]
    assert main([*ask, *KEYFRAMES]) == 0
    said = capsys.readouterr()
    assert (
        '12 scans have no pose in the trajectory and are left out, the first at 1.000' in said.err
    )
    assert len(read_trajectory('out/trajectory.tum')) == 4


def test_a_trajectory_of_another_recording_is_noticed(here, capsys):
    _, _, other = drive(np.random.default_rng(5), points=10)
    bent = np.array([T @ motion(np.random.default_rng(k), 15.0, 0.5) for k, T in enumerate(other)])
    write_tum('drive2.tum', stamps_of(16)[:7], bent[:7])
    ask = ['drive2.tum' if each == 'drive.tum' else each for each in ASK]
    assert main([*ask, *KEYFRAMES]) == 1
    assert 'steps of drive2.tum' in capsys.readouterr().err


def test_what_is_not_connected_is_said_and_written(here, capsys):
    clouds, _, odometry = drive(np.random.default_rng(1), 4)
    clouds[1] = clouds[1] + (30.0, 0.0, 0.0)
    Path('drive.mcap').unlink()
    Path('drive.tum').unlink()
    write_drive(Path(), clouds, odometry)
    assert main([*ASK, *KEYFRAMES]) == 1
    assert (
        '2 parts that only the trajectory holds together; of one keyframe alone: at 1.100 s'
        in (capsys.readouterr().out)
    )
    assert {path.name for path in Path('out').iterdir()} == FILES


@pytest.mark.parametrize(
    ('prepare', 'options', 'code', 'words'),
    [
        (('drive.tum', 'nonsense'), [], 1, 'drive.tum'),
        (('drive.tum', '1 0 0 0 0 1 0 0 0 0 1 0\n'), [], 1, 'poses without stamps'),
        (('drive.tum', '900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n'), [], 1, 'none lies between two'),
        (('loops.txt', '1 2 3\n'), ['--loops', 'loops.txt'], 1, 'line 1'),
        (('loops.txt', '1 999\n'), ['--loops', 'loops.txt'], 1, 'no scan with a pose'),
        (None, ['--keyframe-distance', '50', '--keyframe-turn', '180'], 1, '1 keyframe in 16'),
        (None, ['--voxel-size', 'none'], 2, 'joined on voxels'),
        (None, ['--jobs', '0'], 2, 'from 1'),
        (None, ['--window', '1'], 2, 'window is 1'),
        (('out/else.txt', 'mine'), [], 1, 'is not empty'),
        (('out', 'mine'), [], 1, 'a file of that name'),
    ],
)
def test_what_cannot_be_done_is_one_line_and_leaves_nothing(
    here, capsys, prepare, options, code, words
):
    if prepare:
        name, text = prepare
        path = Path(name)
        path.parent.mkdir(exist_ok=True)
        path.unlink(missing_ok=True)
        path.write_text(text)
    before = sorted(path for path in Path().rglob('*'))
    assert main([*ASK, *options]) == code
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert words in said[0]
    assert sorted(path for path in Path().rglob('*')) == before


@pytest.mark.parametrize(
    'options', [['--motion', 'solve'], ['--motion', 'last'], ['--crop-target']]
)
def test_what_would_be_ignored_is_not_offered(here, capsys, options):
    with pytest.raises(SystemExit) as ended:
        main([*ASK, *options])
    assert ended.value.code == 2
    assert options[0] in capsys.readouterr().err


def test_an_interrupt_leaves_nothing(here, monkeypatch, capsys):
    def interrupt(*_, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(worker_processes, 'in_processes', interrupt)
    before = sorted(Path().iterdir())
    assert main([*ASK, *KEYFRAMES]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == 'idem: interrupted'
    assert sorted(Path().iterdir()) == before
