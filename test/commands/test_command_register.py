import json
from pathlib import Path

import numpy as np
import pytest
from clouds import error_of, motion, surface
from sweeps import START, TWIST, driven, points_of_sweep

from idem_ros.commands.inputs import CLOUD_KINDS
from idem_ros.commands.main import main
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.files.cloud_file import READERS
from idem_ros.files.pose_file import read_pose, write_pose


@pytest.fixture
def files(tmp_path, rng, monkeypatch):
    """Two clouds and a guess in the working folder; returns the true pose."""
    monkeypatch.chdir(tmp_path)
    truth = motion(rng, 30.0, 1.0)
    np.save('target.npy', surface(rng, 600))
    np.save('source.npy', transform_points(inverse(truth), surface(rng, 600)))
    write_pose('guess.txt', motion(rng, 2.0, 0.02) @ truth)
    return truth


def test_prints_the_pose_and_how_it_ended(files, capsys):
    assert main(['register', 'target.npy', 'source.npy', '--guess', 'guess.txt']) == 0
    out = capsys.readouterr().out
    matrix = np.array([line.split() for line in out.splitlines()[1:5]], dtype=float)
    degrees, distance = error_of(matrix, files)
    assert degrees < 1.0
    assert distance < 0.02
    assert out.splitlines()[5].startswith('converged after ')
    assert out.splitlines()[6].startswith(('aligned (p_aligned 0.9', 'aligned (p_aligned 1.0'))


def test_standard_deviations_have_units_and_a_place(files, capsys):
    argv = ['register', 'target.npy', 'source.npy', '--guess', 'guess.txt']
    main([*argv, '--json'])
    result = json.loads(capsys.readouterr().out)
    middle = np.median(np.load('source.npy'), axis=0)
    x, y, z = np.array(result['T_target_source'])[:3, :3] @ middle
    moved = np.eye(6)
    moved[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    covariance = moved @ np.array(result['covariance']) @ moved.T
    m, deg = np.split(np.diag(covariance) ** 0.5, 2)
    x, y, z, rx, ry, rz = (f'{each:.3g}' for each in (*m, *np.degrees(deg)))
    main(argv)
    assert (
        f'standard deviations at the middle of the source: x {x} y {y} z {z} '
        f'in the unit of the files, rx {rx} ry {ry} rz {rz} deg'
    ) in capsys.readouterr().out.splitlines()


def test_far_from_the_origin_digits_and_deviations_still_say_something(files, capsys):
    far = np.array([431234.5, 5412345.6, 312.0])
    source = transform_points(files, np.load('source.npy'))
    np.save('far_target.npy', np.load('target.npy') + far)
    np.save('far_source.npy', source + far)
    main(['register', 'far_target.npy', 'far_source.npy', '--out', 'T.txt'])
    lines = capsys.readouterr().out.splitlines()
    printed = np.array([line.split() for line in lines[1:5]], dtype=float)
    gap = transform_points(printed, source + far) - transform_points(
        np.loadtxt('T.txt'), source + far
    )
    assert np.abs(gap).max() < 1e-5
    (said,) = [line for line in lines if 'at the middle of the source' in line]
    metres = said.split(': ')[1].split(' in the')[0].split()[1::2]
    assert max(map(float, metres)) < 0.01


def test_the_help_names_every_format_that_is_read():
    assert CLOUD_KINDS.split() == list(READERS)


def test_columns_that_no_header_names_are_listed_and_may_be_chosen(files, capsys):
    for name in ('target', 'source'):
        rows = np.c_[np.arange(600), np.load(f'{name}.npy')]
        np.savetxt(f'{name}.csv', rows, delimiter=';', header='a;b;c;d', comments='')
    argv = ['register', 'target.csv', 'source.csv', '--guess', 'guess.txt']
    assert main(argv) == 1
    assert "its columns are 'a', 'b', 'c', 'd'" in capsys.readouterr().err
    assert main([*argv, '--columns', '2,3,4']) == 0
    assert main([*argv, '--columns', 'b,c,d']) == 0
    with pytest.raises(SystemExit):
        main([*argv, '--columns', '1,2'])


def test_a_pose_that_is_not_aligned_has_no_standard_deviations(files, capsys):
    assert main(['register', 'target.npy', 'source.npy', '--voxel-size', '1000']) == 1
    out = capsys.readouterr().out
    assert 'not_converged (p_aligned unknown): 1 and 1 points (or voxels): 5 are needed' in out
    assert 'deviations' not in out


def test_numbers_in_a_row_may_begin_with_a_minus(files, capsys):
    main(['register', 'target.npy', 'source.npy', '--crop-min', '-1e3,-1e3,-inf', '--json'])
    assert json.loads(capsys.readouterr().out)['overlap'] > 0.5
    assert main(['register', 'target.npy', 'source.npy', '--crop-min', '900,-1e3,-1e3']) == 1


def test_the_gap_to_the_swapped_registration_is_told(files, capsys):
    main(['register', 'target.npy', 'source.npy', '--assessment', 'swap'])
    (line,) = [line for line in capsys.readouterr().out.splitlines() if 'to source' in line]
    gap = float(line.removeprefix('target registered to source ends ').removesuffix(' m from it'))
    assert 0.0 <= gap < 0.01


def test_an_audit_moves_nothing_and_its_exit_code_tells_right_from_wrong(files, capsys):
    argv = ['register', 'target.npy', 'source.npy', '--mode', 'audit', '--json', '--guess']
    np.savetxt('truth.txt', files)
    for guess, code, verdict in (('truth.txt', 0, 'aligned'), ('guess.txt', 1, 'misaligned')):
        assert main([*argv, guess]) == code
        result = json.loads(capsys.readouterr().out)
        assert (result['status'], result['verdict']) == ('audited', verdict)
        np.testing.assert_allclose(result['T_target_source'], np.loadtxt(guess))


def test_json_holds_the_whole_result(files, capsys):
    argv = ['register', 'target.npy', 'source.npy', '--guess', 'guess.txt', '--json']
    assert main([*argv, '--out', 'pose.txt', '--voxel-size', '0.05']) == 0
    result = json.loads(capsys.readouterr().out)
    assert result['status'] == 'converged'
    assert result['converged'] is True
    np.testing.assert_array_equal(result['T_target_source'], np.loadtxt('pose.txt'))
    assert np.shape(result['information']) == (6, 6)
    assert error_of(read_pose('pose.txt'), files)[0] < 1.0
    assert {'q_tot', 'q_mean', 'overlap', 'radius', 'iterations', 'target', 'source'} <= set(
        result
    )


def test_without_a_guess_it_starts_from_the_identity(tmp_path, rng, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    points = surface(rng, 300)
    np.save('target.npy', points)
    assert main(['register', 'target.npy', 'target.npy', '--json']) == 0
    pose = json.loads(capsys.readouterr().out)['T_target_source']
    np.testing.assert_allclose(pose, np.eye(4), atol=1e-6)


@pytest.mark.parametrize('guess', [[], ['--guess', 'guess.txt']])
def test_that_it_starts_from_the_identity_is_said_where_it_does(files, capsys, guess):
    main(['register', 'target.npy', 'source.npy', *guess])
    lines = capsys.readouterr().out.splitlines()
    assert ('note: no --guess: the initial guess is the identity' in lines) == (not guess)


def test_what_does_not_overlap_is_a_status_in_valid_json(tmp_path, rng, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    points = surface(rng, 100)
    np.save('target.npy', points)
    np.save('far.npy', points + 100.0)
    np.save('few.npy', points[:2])
    for source, status in (('far.npy', 'no_overlap'), ('few.npy', 'too_few_points')):
        assert main(['register', 'target.npy', source, '--json']) == 1
        result = json.loads(capsys.readouterr().out)
        assert (result['status'], result['converged']) == (status, False)


@pytest.mark.parametrize(
    ('argv', 'code', 'words'),
    [
        (['nowhere.ply', 'source.npy'], 1, 'nowhere.ply cannot be read: No such file'),
        (['target.npy', 'guess.txt', '--guess', 'target.npy'], 1, 'target.npy is no pose'),
        (['target.npy', 'mesh.stl'], 1, 'mesh.stl is no cloud file'),
        (['target.npy', 'source.npy', '--guess', 'none.txt'], 1, 'none.txt cannot be read'),
        (['target.npy', 'source.npy', '--out', 'no/pose.txt'], 1, 'does not exist'),
        (['target.npy', 'source.npy', '--voxel-size', '0'], 2, 'voxel_size is 0.0'),
    ],
)
def test_bad_input_gets_one_line_and_writes_nothing(files, tmp_path, capsys, argv, code, words):
    before = sorted(tmp_path.iterdir())
    assert main(['register', '--out', 'pose.txt', *argv]) == code
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize('option', ['target.npy', 'source.npy', './guess.txt'])
def test_an_input_is_never_replaced_by_the_pose(files, capsys, option):
    before = Path(option).read_bytes()
    argv = ['register', 'target.npy', 'source.npy', '--guess', 'guess.txt', '--out', option]
    assert main(argv) == 2
    assert 'the input' in capsys.readouterr().err
    assert Path(option).read_bytes() == before


def test_the_exit_code_says_whether_it_converged(files, capsys):
    assert main(['register', 'target.npy', 'source.npy', '--voxel-size', '1000']) == 1
    assert 'too_few_points' in capsys.readouterr().out


def test_the_motion_of_a_sweep_is_solved_for_where_the_file_has_times(
    tmp_path, rng, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    points, times = points_of_sweep(rng, driven, START)
    np.save('swept.npy', np.rec.fromarrays([*points.T, times], names='x,y,z,time'))
    np.save('map.npy', surface(rng, 6000, 0.003))
    options = ['--motion', 'solve', '--voxel-size', '0.08', '--json']
    assert main(['register', 'map.npy', 'swept.npy', *options]) == 0
    record = json.loads(capsys.readouterr().out)
    assert error_of(np.array(record['T_target_source']), np.eye(4))[1] < 0.005
    np.testing.assert_allclose(record['twist'], TWIST, atol=0.15)
    assert main(['register', 'map.npy', 'swept.npy', *options[:-1]]) == 0
    assert 'motion of the sweep undone: half of the points moved by' in capsys.readouterr().out


def test_a_motion_that_two_files_do_not_tell_is_refused(files, capsys):
    assert main(['register', 'target.npy', 'source.npy', '--motion', 'last']) == 2
    assert 'solve finds it' in capsys.readouterr().err
