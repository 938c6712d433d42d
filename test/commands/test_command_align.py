import json
from pathlib import Path

import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.commands.main import main
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.files.pose_file import read_poses, write_poses

CLOUDS = ['a.npy', 'b.npy', 'c.npy']


@pytest.fixture
def files(tmp_path, rng, monkeypatch):
    """Three clouds and starts in the working folder; returns the true poses."""
    monkeypatch.chdir(tmp_path)
    truth = [np.eye(4), motion(rng, 30.0, 1.0), motion(rng, 60.0, 1.0)]
    for name, T in zip(CLOUDS, truth, strict=True):
        np.save(name, transform_points(inverse(T), surface(rng, 900)))
    starts = [T if k == 0 else motion(rng, 2.0, 0.02) @ T for k, T in enumerate(truth)]
    write_poses('starts.txt', starts)
    return truth


def test_writes_poses_that_all_agree_and_says_how_well(files, capsys):
    assert main(['align', *CLOUDS, '--poses', 'starts.txt', '--out', 'poses.tum']) == 0
    for T, truth in zip(read_poses('poses.tum', 3), files, strict=True):
        degrees, distance = error_of(T, truth)
        assert degrees < 1.0
        assert distance < 0.02
    out = capsys.readouterr().out
    assert out.startswith('converged after ')
    assert '| 0-2 ' in out
    assert 'closure [deg] | closure [m]' in ' '.join(out.split())
    assert out.count('aligned') == 6  # three clouds, three edges


def test_a_graph_has_a_vertex_a_cloud_and_an_edge_a_pair(files):
    main(['align', *CLOUDS, '--poses', 'starts.txt', '--out', 'graph.g2o'])
    kinds = [line.split()[0] for line in Path('graph.g2o').read_text().splitlines()]
    assert kinds == ['VERTEX_SE3:QUAT'] * 3 + ['EDGE_SE3:QUAT'] * 3


def test_json_holds_poses_edges_and_verdicts(files, capsys):
    assert main(['align', *CLOUDS, '--poses', 'starts.txt', '--json']) == 0
    record = json.loads(capsys.readouterr().out)
    assert np.shape(record['poses']) == (3, 4, 4)
    assert [(edge['i'], edge['j']) for edge in record['edges']] == [(0, 1), (0, 2), (1, 2)]
    assert {said['verdict'] for said in record['verdicts']} == {'aligned'}
    assert record['parts'] == [[0, 1, 2]]
    assert all(0.0 < edge['closure_deg'] < 1.0 for edge in record['edges'])
    assert all(0.0 < edge['closure_m'] < 0.02 for edge in record['edges'])


def test_a_picture_shows_before_and_after(files):
    main(['align', *CLOUDS, '--poses', 'starts.txt', '--picture', 'both.png'])
    assert Path('both.png').read_bytes().startswith(b'\x89PNG\r\n\x1a\n')


def test_a_cloud_that_meets_nothing_is_named_and_the_exit_code_says_so(files, capsys):
    far = files[2].copy()
    far[:3, 3] += 100.0
    write_poses('starts.txt', [*read_poses('starts.txt', 3)[:2], far])
    assert main(['align', *CLOUDS, '--poses', 'starts.txt']) == 1
    out = capsys.readouterr().out
    assert 'separated' in out
    assert 'parts that do not meet: 0 1 and 2' in out


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['a.npy'], 'two at least'),
        (['a.npy', 'b.npy', 'a.npy'], 'a.npy is given twice'),
        (['a.npy', 'b.npy', 'copy.npy'], 'the same points as a.npy'),
        (['a.npy', 'b.npy', '--poses', 'starts.txt'], '3 poses for 2 clouds'),
        (['a.npy', 'none.npy'], 'none.npy'),
        (['a.npy', 'b.npy', '--poses', 'b.tum', '--out', 'b.tum'], 'would replace the input'),
        (['a.npy', 'b.npy', '--out', 'p.xyz'], 'must end in .g2o or .mat or .tum or .txt'),
        (['a.npy', 'b.npy', '--out', 'p'], 'must end in .g2o'),
        (['a.npy', 'b.npy', '--picture', 'x.nonsense'], '--picture is x.nonsense'),
        (['a.npy', 'b.npy', '--held', '2'], 'held names cloud 2'),
    ],
)
def test_what_cannot_be_aligned_is_refused_in_one_line(files, capsys, argv, words):
    np.save('copy.npy', np.load('a.npy'))
    write_poses('b.tum', read_poses('starts.txt', 3)[:2])
    before = np.load('b.npy')
    assert main(['align', *argv]) in (1, 2)
    error = capsys.readouterr().err
    assert words in error
    assert error.count('\n') == 1
    np.testing.assert_array_equal(np.load('b.npy'), before)
