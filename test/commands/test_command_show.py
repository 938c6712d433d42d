import sys

import pytest
from replayed import changed, write_replayed

from idem_ros.commands.main import main

pytest.importorskip('matplotlib')


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    return write_replayed(tmp_path_factory.mktemp('replayed'))


def test_a_page_is_written_and_named(result, tmp_path, capsys):
    page = tmp_path / 'page.html'
    assert main(['show', str(result), '--frame', '1', '--out', str(page)]) == 0
    assert capsys.readouterr().out.startswith(f'{page}: ')
    assert ', frame 1</h1>' in page.read_text(encoding='utf-8')
    assert page.stat().st_size < 15e6


def test_without_a_number_it_is_the_worst_frame(result, tmp_path):
    page = tmp_path / 'page.html'
    assert main(['show', str(result), '--out', str(page)]) == 0
    assert ', frame ' in page.read_text(encoding='utf-8')


@pytest.mark.parametrize('number', ['-1', '1000'])
def test_a_frame_that_there_is_not_is_refused_in_one_line(result, tmp_path, capsys, number):
    page = tmp_path / 'page.html'
    assert main(['show', str(result), '--frame', number, '--out', str(page)]) == 1
    assert f'has no frame {number}: it has ' in capsys.readouterr().err
    assert not page.exists()


def test_a_recording_that_is_gone_is_named(result, tmp_path, capsys):
    other = changed(result, lambda record: record.update(bag='gone.mcap'), 'other')
    page = tmp_path / 'page.html'
    assert main(['show', str(other), '--frame', '0', '--out', str(page)]) == 1
    assert 'gone.mcap' in capsys.readouterr().err
    assert not page.exists()


def test_what_a_recording_says_of_itself_reaches_the_page_without_markup(result, tmp_path):
    name = '<img src=x onerror=alert(1)>'
    other = changed(result, lambda record: None, name.replace('/', ''))
    page = tmp_path / 'page.html'
    assert main(['show', str(other), '--frame', '0', '--out', str(page)]) == 0
    assert '<img src=x' not in page.read_text(encoding='utf-8')


def test_nothing_to_write_is_told_in_one_line(result, capsys):
    assert main(['show', str(result)]) == 2
    assert 'nothing to write' in capsys.readouterr().err


def test_without_rerun_its_option_says_what_to_install(result, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'rerun', None)  # as if it were not installed
    assert main(['show', str(result), '--rerun', str(tmp_path / 'frame.rrd')]) == 2
    told = capsys.readouterr().err.strip()
    assert told.endswith('--rerun needs rerun-sdk: pip install ".[view]"')
    assert '\n' not in told
    assert not list(tmp_path.iterdir())


def test_rerun_gets_the_clouds_the_steps_and_the_verdict(result, tmp_path):
    rerun = pytest.importorskip('rerun', reason='rerun-sdk is not installed')
    file = tmp_path / 'frame.rrd'
    assert main(['show', str(result), '--frame', '0', '--rerun', str(file)]) == 0
    assert file.read_bytes()[:3] == b'RRF'
    assert file.stat().st_size > 10_000
    assert rerun is not None
