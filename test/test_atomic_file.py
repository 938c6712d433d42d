import pytest

from idem_ros.atomic_file import UnwritableFile, replacing, require_writable


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
