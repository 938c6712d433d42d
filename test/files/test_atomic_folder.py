import resource
import subprocess
import sys

import pytest

from idem_ros.files.atomic_file import UnwritableFile, filling, require_free


def test_a_folder_appears_when_it_is_complete(tmp_path):
    with filling(tmp_path / 'new') as temporary:
        (temporary / 'a.txt').write_text('a')
        assert not (tmp_path / 'new').exists()
    assert [file.name for file in tmp_path.iterdir()] == ['new']
    assert (tmp_path / 'new' / 'a.txt').read_text() == 'a'


def test_an_empty_folder_is_filled(tmp_path):
    (tmp_path / 'empty').mkdir()
    with filling(tmp_path / 'empty') as temporary:
        (temporary / 'a.txt').write_text('a')
    assert (tmp_path / 'empty' / 'a.txt').read_text() == 'a'


def test_a_folder_that_is_not_empty_is_refused_and_kept(tmp_path):
    (tmp_path / 'full').mkdir()
    (tmp_path / 'full' / 'mine.txt').write_text('mine')
    with pytest.raises(UnwritableFile, match='full is not empty'), filling(tmp_path / 'full'):
        pytest.fail('the block must not run')
    assert (tmp_path / 'full' / 'mine.txt').read_text() == 'mine'


def test_what_came_meanwhile_is_kept(tmp_path):
    def fill():
        with filling(tmp_path / 'new'):
            (tmp_path / 'new').mkdir()
            (tmp_path / 'new' / 'theirs.txt').write_text('theirs')

    with pytest.raises(UnwritableFile, match='cannot write the folder'):
        fill()
    assert [str(file.relative_to(tmp_path)) for file in sorted(tmp_path.rglob('*'))] == [
        'new',
        'new/theirs.txt',
    ]


@pytest.mark.parametrize(
    ('name', 'words'),
    [('none/new', 'none does not exist'), ('file.txt', 'a file of that name is there')],
)
def test_a_folder_that_cannot_be_made_is_refused(tmp_path, name, words):
    (tmp_path / 'file.txt').write_text('')
    with pytest.raises(UnwritableFile, match=words):
        require_free(tmp_path / name)


@pytest.mark.parametrize('error', [KeyboardInterrupt, OSError(28, 'No space left on device')])
def test_nothing_stays_of_a_folder_that_was_not_finished(tmp_path, error):
    def fill():
        with filling(tmp_path / 'new') as temporary:
            (temporary / 'a.txt').write_text('a')
            raise error

    with pytest.raises(UnwritableFile if isinstance(error, OSError) else error):
        fill()
    assert list(tmp_path.iterdir()) == []


def test_nothing_stays_when_the_system_refuses_to_write_more(tmp_path):
    code = (
        'import sys; from idem_ros.files.atomic_file import filling\n'
        'with filling(sys.argv[1]) as folder:\n'
        '    (folder / "a.txt").write_text("a")\n'
        '    (folder / "b.bin").write_bytes(bytes(100_000))\n'
    )

    def no_large_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))

    run = subprocess.run(
        [sys.executable, '-B', '-c', code, tmp_path / 'new'],
        capture_output=True,
        text=True,
        preexec_fn=no_large_files,
    )
    assert run.returncode == 1
    assert 'UnwritableFile: cannot write the folder' in run.stderr
    assert list(tmp_path.iterdir()) == []
