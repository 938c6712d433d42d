"""Outputs of all commands: what is there already is replaced and named, or refused."""

import re

import numpy as np
import pytest
from mcap.writer import Writer
from recordings import scans

from idem_ros.commands.main import command_line, main
from idem_ros.recording.writer import write_mcap

ONE_FILE = {
    'replay': 'replay scans.mcap --json out',
    'bag': 'bag a.xyz b.xyz --out out.mcap',
    'simulate': 'simulate --scans 2 --out out.mcap',
    'truth': 'truth scans.mcap --out out',
    'register': 'register a.xyz b.xyz --out out',
    'align': 'align a.xyz b.xyz --out out.tum',
    'gate': 'gate result.json --rules rules.yaml --junit out',
    'show': 'show result.json --out out.html',
}


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp('made')
    write_mcap(folder / 'scans.mcap', scans(np.random.default_rng(0)))
    for name in 'ab':
        points = np.random.default_rng(ord(name)).uniform(0, 3, (2000, 3))
        np.savetxt(folder / f'{name}.xyz', points)
    (folder / 'rules.yaml').write_text('rules: [frames > 1]')
    assert main(['replay', str(folder / 'scans.mcap'), '--json', str(folder / 'result.json')]) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    for file in made.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def foreign_recording(path):
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start(profile='ros2', library='libmcap 1.4')
        writer.finish()


@pytest.mark.parametrize('name', ONE_FILE)
def test_a_file_that_is_there_is_replaced_and_named(folder, capsys, name):
    argv = ONE_FILE[name].split()
    (folder / argv[-1]).write_text('older')
    capsys.readouterr()
    assert main(argv) in (0, 1)
    assert f'note: {argv[-1]} was there already and is replaced' in capsys.readouterr().err
    assert (folder / argv[-1]).read_bytes() != b'older'


@pytest.mark.parametrize('name', ONE_FILE)
def test_an_empty_or_a_new_file_is_not_worth_a_word(folder, capsys, name):
    argv = ONE_FILE[name].split()
    (folder / argv[-1]).touch()
    capsys.readouterr()
    assert main(argv) in (0, 1)
    assert 'was there already' not in capsys.readouterr().err
    assert (folder / argv[-1]).stat().st_size


@pytest.mark.parametrize('name', ['replay', 'bag', 'simulate', 'truth', 'register', 'gate'])
@pytest.mark.parametrize('kind', ['a recording of others', 'a recording cut off', 'a cloud'])
def test_what_somebody_else_recorded_is_never_replaced(folder, capsys, name, kind):
    *argv, out = ONE_FILE[name].split()
    if kind == 'a cloud' and out.endswith('.mcap'):
        pytest.skip('its output cannot have the name of a cloud')
    path = folder / ('theirs.pcd' if kind == 'a cloud' else 'theirs.mcap')
    foreign_recording(path)
    if kind == 'a recording cut off':
        path.write_bytes(path.read_bytes()[:12])
    before = path.read_bytes()
    assert main([*argv, path.name]) == 2
    assert 'was not written by idem; name another file' in capsys.readouterr().err
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ('argv', 'lost'),
    [
        ('truth scans.mcap --out scans.mcap', 'scans.mcap'),
        ('register a.xyz b.xyz --out ./b.xyz', 'b.xyz'),
        ('bag a.xyz b.xyz --guess g.mcap --out g.mcap', 'g.mcap'),
        ('gate result.json --rules rules.yaml --junit rules.yaml', 'rules.yaml'),
    ],
)
def test_no_input_is_replaced(folder, capsys, argv, lost):
    (folder / 'g.mcap').write_text('1 0 0 0')
    before = (folder / lost).read_bytes()
    assert main(argv.split()) == 2
    assert 'which would replace the input' in capsys.readouterr().err
    assert (folder / lost).read_bytes() == before


def test_every_command_that_writes_a_file_is_among_those_tried():
    choices = next(each.choices for each in command_line()._actions if each.choices)
    writing = {
        name
        for name, parser in choices.items()
        for action in parser._actions
        if action.option_strings and re.search(r'\bwrite\b', action.help or '')
        if str(action.metavar).startswith('FILE')
    }
    assert writing == set(ONE_FILE)
