import re
from pathlib import Path

import pytest

from idem_ros.commands.main import COMMANDS, main
from idem_ros.core import IdemError
from idem_ros.documentation import with_blocks

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / 'README.md').read_text()
MARKED = 'a\n<!-- x: written by `make docs` -->\nold\n<!-- end of x -->\nb\n'


def test_the_readme_says_what_the_code_says(capsys):
    assert main(['docs', '--check', '--readme', str(ROOT / 'README.md')]) == 0, (
        'run make docs and commit'
    )


@pytest.mark.parametrize('command', COMMANDS)
def test_the_readme_shows_every_command(command):
    name = command.__name__.rpartition('.')[2]
    assert re.search(rf'^(idem|make) {name}\b|`(idem|make) {name}\b', README, re.MULTILINE)


def test_a_block_is_replaced_and_the_rest_is_kept():
    assert with_blocks(MARKED, {'x': 'new'}) == MARKED.replace('old', 'new')


def test_a_document_without_the_marks_is_refused():
    with pytest.raises(IdemError, match='once each'):
        with_blocks('a\nb\n', {'x': 'new'})


def test_a_table_out_of_date_is_told_by_the_exit_code(tmp_path, capsys):
    (tmp_path / 'docs').mkdir()
    for report in (ROOT / 'docs').glob('*.md'):
        (tmp_path / 'docs' / report.name).write_text(report.read_text())
    text = (ROOT / 'README.md').read_text()
    (tmp_path / 'README.md').write_text(text.replace('`voxel_size`', '`voxelsize`'))
    assert main(['docs', '--check', '--readme', str(tmp_path / 'README.md')]) == 1
    assert 'out of date' in capsys.readouterr().out


def test_a_readme_that_is_not_there_is_named(tmp_path, capsys):
    assert main(['docs', '--readme', str(tmp_path / 'NONE.md')]) == 2
    assert 'NONE.md does not exist' in capsys.readouterr().err
