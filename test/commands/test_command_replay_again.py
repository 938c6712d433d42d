import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from recordings import scans

from idem_ros.commands.main import main
from idem_ros.recording.writer import write_mcap
from idem_ros.results.result_file import read_result


@pytest.fixture
def folder(tmp_path, rng, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mcap('scans.mcap', scans(rng))
    return tmp_path


def transforms_in(file):
    return [frame['T_target_source'] for frame in json.loads(Path(file).read_text())['frames']]


@pytest.mark.parametrize('method', ['idem', 'gicp'])
def test_a_result_repeats_itself_bit_for_bit(folder, capsys, method):
    if method != 'idem':
        pytest.importorskip('small_gicp')
    argv = ['--method', method, '--voxel-size', '0.1', '--min-range', '0.2', '--every', '2']
    assert main(['replay', 'scans.mcap', *argv, '--json', 'r.json', '--out', 'r.mcap']) == 0
    for result in ('r.json', 'r.mcap'):
        for bag in ([], ['scans.mcap']):
            assert main(['replay', *bag, '--again', result, '--json', 'again.json']) == 0
            assert '2 of 2 frames agree bit for bit' in capsys.readouterr().out
            assert transforms_in('again.json') == transforms_in('r.json')
            assert read_result('again.json').made_by == read_result('r.json').made_by


def test_a_recording_beside_its_result_is_found(folder, capsys, monkeypatch):
    assert main(['replay', 'scans.mcap', '--out', 'r.mcap']) == 0
    (folder / 'sub').mkdir()
    monkeypatch.chdir(folder / 'sub')
    assert main(['replay', '--again', '../r.mcap']) == 0
    (folder / 'scans.mcap').rename(folder / 'moved.mcap')
    assert main(['replay', '--again', '../r.mcap']) == 1
    assert 'neither at scans.mcap nor beside it' in capsys.readouterr().err
    assert main(['replay', '../moved.mcap', '--again', '../r.mcap']) == 0


def test_a_frame_that_differs_is_named(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 0
    record = json.loads((folder / 'r.json').read_text())
    record['frames'][1]['T_target_source'][0][3] += 1e-9
    record['frames'][2]['q_tot'] = None
    record['made_by']['versions']['numpy'] = '0.0'
    (folder / 'r.json').write_text(json.dumps(record))
    capsys.readouterr()
    assert main(['replay', '--again', 'r.json']) == 1
    out = capsys.readouterr().out
    assert f'note: numpy was 0.0 and is {np.__version__}' in out
    assert '1 of 3 frames agree bit for bit' in out
    words = 'differs: frame 1 (stamp 1.200000000 s): T_target_source differs by up to 1e-09'
    assert words in out


def test_another_recording_is_refused_with_both_checksums(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 0
    then = read_result('r.json').made_by['input']['sha256']
    write_mcap('scans.mcap', scans(np.random.default_rng(1)))
    now = hashlib.sha256((folder / 'scans.mcap').read_bytes()).hexdigest()
    capsys.readouterr()
    assert main(['replay', '--again', 'r.json']) == 1
    error = capsys.readouterr().err
    assert then in error
    assert now in error
    assert error.count('\n') == 1


def test_a_result_that_does_not_say_how_it_was_made_cannot_be_repeated(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 0
    record = json.loads((folder / 'r.json').read_text())
    del record['made_by']
    (folder / 'r.json').write_text(json.dumps(record))
    assert main(['replay', '--again', 'r.json']) == 1
    assert 'r.json does not say how it was made' in capsys.readouterr().err


def test_a_result_is_not_replaced_by_its_repetition(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 0
    assert main(['replay', '--again', 'r.json', '--json', 'r.json']) == 2
    assert '--json is r.json, which would replace the input r.json' in capsys.readouterr().err


def test_a_recording_that_lies_elsewhere_is_not_opened(folder, capsys):
    assert main(['replay', 'scans.mcap', '--json', 'r.json']) == 0
    (folder / 'mine').mkdir()
    assert main(['replay', '--again', 'r.json', '--recordings-under', 'mine']) == 1
    assert 'does not lie in mine' in capsys.readouterr().err
    assert main(['replay', '--again', 'r.json', '--recordings-under', '.']) == 0


def test_the_folder_of_recordings_is_for_results_only(capsys):
    assert main(['replay', 'scans.mcap', '--recordings-under', '.']) == 2
    assert 'needs --again' in capsys.readouterr().err
