import os
import subprocess
import sys

import pytest

from idem_ros.files.atomic_file import UnwritableFile, replacing, require_writable


def write_half(path, error):
    with replacing(path) as temporary:
        temporary.write_text('half')
        raise error


def test_the_file_appears_when_the_block_succeeds(tmp_path):
    path = tmp_path / 'result.txt'
    with replacing(path) as temporary:
        temporary.write_text('new')
        assert not path.exists()
    assert path.read_text() == 'new'
    assert list(tmp_path.iterdir()) == [path]


def test_what_stood_there_stays_when_the_block_fails(tmp_path):
    path = tmp_path / 'result.txt'
    path.write_text('old')
    with pytest.raises(RuntimeError, match='half way'):
        write_half(path, RuntimeError('half way'))
    assert path.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupt_leaves_nothing_behind(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        write_half(tmp_path / 'result.txt', KeyboardInterrupt())
    assert list(tmp_path.iterdir()) == []


def test_the_temporary_path_is_beside_and_keeps_the_suffix(tmp_path):
    with replacing(tmp_path / 'result.mcap') as temporary:
        temporary.touch()
        assert temporary.parent == tmp_path
        assert temporary.suffix == '.mcap'


def test_a_symbolic_link_is_followed(tmp_path):
    target, link = tmp_path / 'real.txt', tmp_path / 'link.txt'
    target.write_text('old')
    link.symlink_to(target)
    with replacing(link) as temporary:
        temporary.write_text('new')
    assert link.is_symlink()
    assert target.read_text() == 'new'


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(UnwritableFile, match='missing does not exist'):
        require_writable(tmp_path / 'missing' / 'result.txt')


def test_output_below_a_file_is_refused_before_the_work(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(UnwritableFile, match='file is no folder; name another'):
        require_writable(tmp_path / 'file' / 'out.json')


def test_a_folder_in_the_place_of_the_file_is_refused(tmp_path):
    with pytest.raises(UnwritableFile, match='not a regular file'):
        require_writable(tmp_path)


def test_a_device_is_not_replaced_by_a_file():
    with pytest.raises(UnwritableFile, match='not a regular file'), replacing('/dev/null'):
        pass


def test_a_failure_to_write_is_reported_with_the_name(tmp_path):
    path = tmp_path / 'result.txt'
    with pytest.raises(UnwritableFile, match=r'result.txt: No space left'), replacing(path):
        raise OSError(28, 'No space left on device')


def test_temporary_names_differ_and_what_stands_there_is_never_opened(tmp_path):
    names = set()
    for _ in range(5):
        with replacing(tmp_path / 'result.txt') as temporary:
            assert temporary.is_file()
            assert not temporary.is_symlink()
            names.add(temporary.name)
    assert len(names) == 5
    assert all(len(name) > 24 and 'result' not in name for name in names)


def test_a_file_is_as_readable_as_others_are(tmp_path):
    (tmp_path / 'plain').touch()
    with replacing(tmp_path / 'result.txt') as temporary:
        temporary.write_text('new')
    assert (tmp_path / 'result.txt').stat().st_mode == (tmp_path / 'plain').stat().st_mode


@pytest.mark.parametrize('path', ['/dev/stdout', '/dev/stderr', '/dev/fd/1', '/proc/self/fd/1'])
def test_an_open_file_of_the_process_is_no_output(path):
    with pytest.raises(UnwritableFile, match='regular file'):
        require_writable(path)


def test_a_standard_output_that_is_a_file_is_not_replaced_by_another(tmp_path):
    script = (
        'from idem_ros.files.atomic_file import require_writable; require_writable("/dev/stdout")'
    )
    with (tmp_path / 'out').open('w') as out:
        ended = subprocess.run(
            [sys.executable, '-c', script], stdout=out, stderr=subprocess.PIPE, check=False
        )
    assert b'no regular file' in ended.stderr


@pytest.mark.parametrize(
    'name', ['x' * 256, 'x' * 5000, 'x' * 300 + '/a', '/' * 5000 + 'proc/none', '\0']
)
def test_a_name_that_no_file_can_have_is_refused_before_the_work(tmp_path, name):
    with pytest.raises(UnwritableFile, match='cannot write'):
        require_writable(tmp_path / name)


def test_a_name_that_just_fits_is_written(tmp_path):
    for name in ('x' * 255, 'x' * 200 + '.' + 'y' * 54):
        with replacing(tmp_path / name) as temporary:
            temporary.write_text('new')
        assert (tmp_path / name).read_text() == 'new'


def test_a_link_that_leads_in_a_circle_is_refused(tmp_path):
    (tmp_path / 'a').symlink_to('b')
    (tmp_path / 'b').symlink_to('a')
    with pytest.raises(UnwritableFile):
        require_writable(tmp_path / 'a')


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can give a link to another user')
def test_a_link_of_another_user_is_not_followed(tmp_path):
    (tmp_path / 'precious').write_text('old')
    (tmp_path / 'link').symlink_to('precious')
    os.chown(tmp_path / 'link', 12345, 12345, follow_symlinks=False)
    with pytest.raises(UnwritableFile, match='a link of another user'):
        require_writable(tmp_path / 'link')
