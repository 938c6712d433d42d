import json

import pytest
from results import write_result

from idem_ros.evaluation.result_folder import OtherResults, open_folder, result_file
from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.results.result_file import UnreadableResult

MADE_WITH = {'settings': {'parameters': {'a': 1.0, 'b': [1.0]}, 'method': 'idem'}, 'topics': {}}
INPUT = {'name': 'a b.mcap', 'size': 3, 'sha256': '0123456789abcdef'}
IDENTITY = 'a b.mcap 3 0123456789abcdef'


def put_result(folder, settings=None, **made_by):
    path = result_file(folder, IDENTITY)
    write_result(path, ['converged'])
    record = json.loads(path.read_text())
    record['made_by'] = {'input': INPUT, **(settings or MADE_WITH['settings']), **made_by}
    path.write_text(json.dumps(record))
    return path


@pytest.fixture
def folder(tmp_path):
    assert open_folder(tmp_path / 'results', MADE_WITH) == {}
    return tmp_path / 'results'


def test_a_new_folder_says_what_its_results_are_made_with(folder):
    assert json.loads((folder / 'evaluation.json').read_text()) == MADE_WITH


def test_what_is_there_of_the_same_settings_is_found(folder):
    path = put_result(folder)
    (folder / 'summary.json').write_text('{}')
    (folder / '.b.1.part.json').write_text('half')
    assert open_folder(folder, MADE_WITH) == {IDENTITY: path}
    assert path.name == 'a b.01234567.json'


def test_other_settings_are_refused_and_named(folder):
    other = {**MADE_WITH, 'settings': {'parameters': {'a': 2.0, 'b': [1.0]}, 'method': 'icp'}}
    with pytest.raises(OtherResults, match=r'other a, method;'):
        open_folder(folder, other)
    with pytest.raises(OtherResults, match=r'other source_topic;'):
        open_folder(folder, {**MADE_WITH, 'topics': {'source_topic': '/x'}})


def test_a_result_of_other_settings_among_them_is_refused(folder):
    path = put_result(folder, {**MADE_WITH['settings'], 'method': 'icp'})
    with pytest.raises(OtherResults, match=path.name):
        open_folder(folder, MADE_WITH)


def test_a_folder_of_other_files_is_refused_and_left_alone(tmp_path):
    (tmp_path / 'thesis.txt').write_text('years of work')
    with pytest.raises(OtherResults, match='other files'):
        open_folder(tmp_path, MADE_WITH)
    assert [path.name for path in tmp_path.iterdir()] == ['thesis.txt']


def test_a_damaged_folder_is_refused(folder):
    put_result(folder).write_text('{')
    with pytest.raises(UnreadableResult, match='no JSON'):
        open_folder(folder, MADE_WITH)
    (folder / 'evaluation.json').write_text('{')
    with pytest.raises(OtherResults, match='cannot be read'):
        open_folder(folder, MADE_WITH)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / 'file').touch()
    for name, words in (('no/where', 'no does not exist'), ('file', 'cannot make the folder')):
        with pytest.raises(UnwritableFile, match=words):
            open_folder(tmp_path / name, MADE_WITH)
