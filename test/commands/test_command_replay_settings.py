import sys
from dataclasses import replace

import numpy as np
import pytest
from recordings import scans

from idem_ros.commands.main import main
from idem_ros.recording.messages import header, transform_message
from idem_ros.recording.writer import write_mcap
from idem_ros.results.result_file import read_result


@pytest.fixture
def folder(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mcap('scans.mcap', scans(rng))
    return tmp_path


def test_several_methods_have_a_block_each_and_files_of_their_own(folder, capsys):
    pytest.importorskip('small_gicp')
    argv = ['replay', 'scans.mcap', '--voxel-size', '0.1', '--method', 'idem,gicp', '--method']
    assert main([*argv, 'ICP', '--json', 'r.json', '--out', 'r.mcap', '--tum', 'r.tum']) == 0
    out = capsys.readouterr().out
    blocks = [line.split()[0] for line in out.splitlines() if line.endswith('after')]
    assert blocks == ['idem', 'gicp', 'icp']
    assert out.count('3 registered') == 3
    for method in blocks:
        result = read_result(f'r.{method}.mcap')
        assert result.record == read_result(f'r.{method}.json').record
        assert result.record['method'] == result.made_by['method'] == method
        assert len(np.loadtxt(f'r.{method}.tum')) == 3
        assert all(np.isfinite(result.values(n)).all() for n in ('q_tot', 'overlap', 'radius'))
    versions = read_result('r.gicp.json').made_by['versions']
    assert versions['small_gicp']
    assert not (folder / 'r.json').exists()


def test_one_method_writes_the_file_that_is_named(folder, capsys):
    pytest.importorskip('small_gicp')
    argv = ['replay', 'scans.mcap', '--method', 'vgicp', '--max-distance', '0.4', '--json']
    assert main([*argv, 'r.json']) == 0
    assert read_result('r.json').made_by['max_distance'] == 0.4


def test_without_small_gicp_a_peer_is_refused_in_one_line(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'small_gicp', None)
    assert main(['replay', 'scans.mcap', '--method', 'gicp']) == 1
    error = capsys.readouterr().err
    assert "pip install '.[bench]'" in error
    assert error.count('\n') == 1


def test_a_method_that_is_none_is_refused(folder, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['replay', 'scans.mcap', '--method', 'idem,ndt'])
    assert ended.value.code == 2
    assert "'ndt' is none of idem, icp" in capsys.readouterr().err


def test_a_span_and_every_nth_source_are_refined(folder, capsys):
    argv = ['replay', 'scans.mcap', '--start', '0.15', '--duration', '5', '--every', '2']
    assert main([*argv, '--json', 'r.json']) == 0
    assert [frame['stamp'] for frame in read_result('r.json').frames] == [1.2]
    assert 'note: 2 sources left out' in capsys.readouterr().out


def test_a_file_of_parameters_holds_where_no_option_is_given(folder, capsys):
    (folder / 'p.yaml').write_text(
        '/**:\n  ros__parameters:\n    voxel_size: 0.1\n    max_iterations: 1\n    depth: 7\n'
    )
    argv = ['replay', 'scans.mcap', '--params', 'p.yaml', '--max-iterations', '30', '--json']
    assert main([*argv, 'r.json']) == 0
    parameters = read_result('r.json').made_by['parameters']
    assert (parameters['voxel_size'], parameters['max_iterations']) == (0.1, 30)
    assert 'note: p.yaml: depth let pass, of a live node only' in capsys.readouterr().out
    assert main(['replay', 'scans.mcap', '--params', 'p.yaml', '--tum', 'p.yaml']) == 2
    assert 'would replace the input p.yaml' in capsys.readouterr().err
    (folder / 'p.yaml').write_text('/**:\n  ros__parameters:\n    voxelsize: 0.1\n')
    assert main([*argv, 'r.json']) == 2
    assert 'p.yaml sets voxelsize, which no parameter is' in capsys.readouterr().err


def test_an_interruption_writes_what_was_done(folder, capsys, monkeypatch):
    def interrupting(messages, total):
        for message in messages:
            if message[1] >= 1_300_000_000:
                raise KeyboardInterrupt
            yield message

    monkeypatch.setattr('idem_ros.commands.replay._progress', interrupting)
    argv = ['replay', 'scans.mcap', '--json', 'r.json', '--out', 'r.mcap', '--tum', 'r.tum']
    assert main(argv) == 130
    out = capsys.readouterr().out
    assert '2 registered' in out
    assert 'note: interrupted' in out
    assert read_result('r.mcap').record['summary']['interrupted'] is True
    assert len(np.loadtxt('r.tum')) == len(read_result('r.json').frames) == 2
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert main(['replay', '--again', 'r.mcap']) == 0
    assert '2 of 2 frames agree' in capsys.readouterr().out


def test_an_interruption_before_the_first_result_leaves_no_file(folder, capsys, monkeypatch):
    def interrupting(messages, total):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr('idem_ros.commands.replay._progress', interrupting)
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 130
    assert 'interrupted' in capsys.readouterr().err
    assert not (folder / 'r.json').exists()


def test_odometry_gives_a_trajectory_and_its_errors(folder, capsys):
    rng = np.random.default_rng(0)
    messages = list(scans(rng, n=4))
    still = messages[1]  # the same scan again and again: a sensor that stands still
    clouds = [
        ('/points', 10**9 + i, replace(still[2], header=header(i, 'lidar'))) for i in (1, 2, 3)
    ]
    poses = [
        ('/ground_truth', 2 * 10**9 + i, transform_message(np.eye(4), i, 'map', 'lidar'))
        for i in (1, 2, 3)
    ]
    write_mcap('still.mcap', clouds + poses)
    argv = ['replay', 'still.mcap', '--sequence', 'submap', '--voxel-size', '0.1']
    assert main([*argv, '--tum', 'r.tum', '--json', 'r.json', '--out', 'r.mcap']) == 0
    assert 'the trajectory, begun on the truth' in capsys.readouterr().out
    np.testing.assert_allclose(np.loadtxt('r.tum')[:, 1:], [[0] * 6 + [1]] * 3, atol=5e-3)
    result = read_result('r.mcap')
    sequence = result.record['sequence']
    assert (sequence['map'], sequence['first_stamp']) == ('submap', 1)
    assert sequence['errors']['ape']['translation_m']['max'] < 5e-3
    assert result.made_by['sequence'] == 'submap'
    assert main(['replay', '--again', 'r.mcap']) == 0
    assert '2 of 2 frames agree bit for bit' in capsys.readouterr().out


def test_odometry_has_neither_target_nor_guess(folder, capsys):
    for option in ('--target-topic', '--guess-topic'):
        assert main(['replay', 'scans.mcap', '--sequence', 'scan', option, 'x']) == 1
        assert 'x is named, but a sequence has neither' in capsys.readouterr().err
