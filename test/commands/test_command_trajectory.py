import json
from pathlib import Path

import numpy as np
import pytest
from trajectories import drive, write_csv, write_kitti

from idem_ros.commands.main import main
from idem_ros.files.pose_file import write_tum
from idem_ros.trajectory.errors import ape, statistics


@pytest.fixture
def pair(tmp_path, rng, monkeypatch):
    """A drive of 60 m and its estimate, in every format."""
    monkeypatch.chdir(tmp_path)
    pair = drive(rng)
    for name, trajectory in zip(('truth', 'found'), pair, strict=True):
        write_tum(f'{name}.tum', trajectory.stamps, trajectory.poses)
        write_csv(Path(f'{name}.csv'), trajectory.stamps, trajectory.poses)
        write_kitti(f'{name}.txt', trajectory.poses)
    return pair


def record(capsys, *argv):
    assert main(['trajectory', *argv, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_prints_a_row_of_statistics_for_each_error(pair, capsys):
    assert main(['trajectory', 'truth.tum', 'found.tum', '--delta', '10f', '2.5m']) == 0
    out = capsys.readouterr().out
    assert '200 poses matched, of 200 in the reference and 200 in the estimate' in out
    assert 'not aligned' in out
    cells = [line.split('|')[1:-1] for line in out.splitlines() if line.startswith('| ')]
    rows = {name.strip(): numbers for name, *numbers in cells}
    assert list(rows)[2:] == [
        f'{name} {measure}'
        for name in ('APE', 'RPE 10 f', 'RPE 2.5 m')
        for measure in ('translation [m]', 'rotation [deg]', 'full [-]')
    ]
    expected = statistics(ape(*pair).translation_m)
    found = [float(cell) for cell in rows['APE translation [m]']]
    np.testing.assert_allclose(found, [*expected.values(), 200], rtol=1e-5)
    assert 'none, the path is shorter than 100 m' in out


def test_every_format_gives_the_same_numbers(pair, capsys):
    records = [
        record(capsys, f'truth.{first}', f'found.{second}')
        for first, second in (('tum', 'tum'), ('csv', 'tum'), ('txt', 'csv'), ('txt', 'txt'))
    ]
    for other in records[1:]:
        assert other['ape']['full'] == pytest.approx(records[0]['ape']['full'], abs=1e-8)


def test_alignment_lowers_the_absolute_error_and_leaves_the_relative_one(pair, capsys):
    given, aligned = (record(capsys, 'truth.tum', 'found.tum', *a) for a in ([], ['--align']))
    rmse = [r['ape']['translation_m']['rmse'] for r in (given, aligned)]
    assert rmse[1] < 0.5 * rmse[0]
    assert given['alignment'] is None
    assert np.shape(aligned['alignment']) == (4, 4)
    assert aligned['rpe'][1]['full'] == pytest.approx(given['rpe'][1]['full'], abs=1e-9)


def test_short_paths_have_segments_where_lengths_are_given(pair, capsys):
    kitti = record(capsys, 'truth.txt', 'found.txt', '--lengths', '10', '30')['kitti']
    assert [row['length_m'] for row in kitti['by_length']] == [10, 30]
    assert kitti['segments'] == sum(row['segments'] for row in kitti['by_length']) > 10
    assert main(['trajectory', 'truth.txt', 'found.txt', '--lengths', '10', '30']) == 0
    assert 'rotation [deg/100 m]' in capsys.readouterr().out


def test_a_delta_beyond_the_path_has_no_pairs(pair, capsys):
    assert main(['trajectory', 'truth.tum', 'found.tum', '--delta', '1000m']) == 0
    assert '| - |' in ' '.join(capsys.readouterr().out.split())
    errors = record(capsys, 'truth.tum', 'found.tum', '--delta', '1000', 'm')['rpe'][0]
    assert (errors['delta'], errors['unit'], errors['pairs']) == (1000, 'm', 0)
    assert errors['translation_m']['rmse'] is None


def test_all_pairs_begin_at_each_pose(pair, capsys):
    argv = 'truth.tum', 'found.tum', '--delta', '10f'
    assert record(capsys, *argv)['rpe'][0]['pairs'] == 19
    assert record(capsys, *argv, '--all-pairs')['rpe'][0]['pairs'] == 190


@pytest.mark.parametrize(
    ('argv', 'code', 'words'),
    [
        (['truth.tum', 'none.tum'], 1, 'none.tum cannot be read'),
        (['truth.tum', 'short.txt'], 1, 'has 200 poses and the estimate 1'),
        (['truth.tum', 'later.tum'], 1, 'no stamp of the estimate is within 0.01 s'),
        (['truth.tum', 'found.tum', '--delta', '1km'], 2, '--delta is 1km; it must be metres'),
        (['truth.tum', 'found.tum', '--delta', '1.5f'], 2, 'frames whole'),
        (['truth.tum', 'found.tum', '--delta', '0m'], 2, 'must be positive'),
        (['truth.tum', 'found.tum', '--lengths', 'nan'], 2, '--lengths is nan'),
        (['truth.tum', 'found.tum', '--lengths', '0'], 2, '--lengths is 0.0'),
        (['truth.tum', 'found.tum', '--tolerance', '-1'], 2, '--tolerance is -1'),
    ],
)
def test_bad_input_gets_one_line(pair, tmp_path, capsys, argv, code, words):
    (tmp_path / 'short.txt').write_text('1 0 0 0 0 1 0 0 0 0 1 0\n')
    (tmp_path / 'later.tum').write_text('1 0 0 0 0 0 0 1\n')
    assert main(['trajectory', *argv]) == code
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('idem: error: ')
    assert captured.err.count('\n') == 1
    assert words in captured.err
