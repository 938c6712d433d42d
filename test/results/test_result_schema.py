import copy
import json

import pytest
from replayed import changed, write_replayed

from idem_ros.commands.main import main
from idem_ros.results.result_file import UnreadableResult, read_result
from idem_ros.results.result_schema import Frame

WRONG = [None, True, -1, 1e300, 'x\x00y', [], {}, [[]], {'a': 1}, 2**62]


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    path = write_replayed(tmp_path_factory.mktemp('result'))
    made_by = {
        'versions': {'numpy': '2.0'},
        'input': {'name': 'scans.mcap', 'size': 1, 'sha256': '0' * 64},
        'topics': {'target': '/target', 'source': '/source', 'guess': None, 'truth': None},
        'parameters': {'voxel_size': 0.5, 'radius_schedule': [2.0, 1.0]},
        'method': 'idem',
    }
    return changed(path, lambda record: record.update(made_by=made_by), 'whole')


def places(value, place=()):
    """Yield where a record holds something, into the first of each list."""
    yield place
    inner = value.items() if isinstance(value, dict) else enumerate(value[:1])
    for key, each in inner:
        if isinstance(each, dict | list):
            yield from places(each, (*place, key))
        else:
            yield (*place, key)


def replaced(record, place, value):
    record = copy.deepcopy(record)
    if not place:
        return value
    inner = record
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return record


def test_all_that_a_replay_says_of_a_frame_has_a_type_and_a_range(result):
    for frame in json.loads(result.read_text())['frames']:
        assert frame.keys() <= Frame.model_fields.keys()


@pytest.mark.parametrize('value', WRONG, ids=str)
def test_whatever_stands_in_the_place_of_a_field_is_taken_or_refused_in_one_line(
    result, tmp_path, value
):
    record, refused = json.loads(result.read_text()), 0
    for place in places(record):
        path = tmp_path / 'a.json'
        path.write_text(json.dumps(replaced(record, place, value)))
        reason = ''
        try:
            read = read_result(path)
        except UnreadableResult as error:
            reason = str(error)
            refused += 1
        assert reason.isprintable()
        assert len(reason) < 500
        assert reason or all(len(read.values(name)) == len(read.frames) for name in read.numbers())
    assert refused > 5


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda r: r['frames'][1].update(verdict=None), 'frames.1.verdict is null'),
        (lambda r: r['frames'][1].update(status=3), 'frames.1.status is 3'),
        (lambda r: r['frames'][1].update(time_ms='3'), 'frames.1.time_ms is "3"'),
        (lambda r: r['frames'][1].update(overlap=1.5), 'frames.1.overlap is 1.5'),
        (lambda r: r['frames'][1].update(anything=[1e200]), 'which nothing measures'),
        (lambda r: r['frames'][1].update(T_guess=[[1.0]]), 'frames.1.T_guess.0'),
        (lambda r: r['frames'][1].update(covariance=[[1.0]]), 'frames.1.covariance.0 is a list'),
        (lambda r: r['frames'][1]['T_guess'][0].__setitem__(0, 7), 'it is not rigid'),
        (lambda r: r['frames'][1].update(stamp_ns=2**62), 'frames.1.stamp_ns is'),
        (lambda r: r['frames'].__setitem__(1, None), 'frames.1 is null'),
        (lambda r: r['summary'].update(frames=-1), 'summary.frames is -1'),
        (lambda r: r.update(made_by=None), 'made_by is null'),
        (lambda r: r['made_by']['input'].update(name='../../a'), 'a name without folders'),
        (lambda r: r.update(bag='a\0b'), 'a zero byte'),
        (lambda r: r.update(notes='none'), 'notes is "none"'),
    ],
)
def test_a_field_of_another_type_is_named(result, change, words):
    with pytest.raises(UnreadableResult) as refused:
        read_result(changed(result, change, 'other'))
    assert words in str(refused.value)


@pytest.mark.parametrize('command', ['gate', 'compare', 'report', 'again'])
def test_every_command_refuses_what_the_schema_does(result, tmp_path, capsys, command):
    bad = str(changed(result, lambda r: r['frames'][0].update(verdict=None), 'bad'))
    (tmp_path / 'rules.yaml').write_text('rules: [frames > 1]')
    arguments = {
        'gate': ['gate', bad, '--rules', str(tmp_path / 'rules.yaml')],
        'compare': ['compare', str(result), bad],
        'report': ['report', bad, '--out', str(tmp_path / 'report')],
        'again': ['replay', '--again', bad],
    }
    assert main(arguments[command]) == 1
    assert 'frames.0.verdict is null' in capsys.readouterr().err


def test_what_a_later_version_adds_is_let_pass(result):
    def add(record):
        record['frames'][0].update(new_number=1.5, new_list=[1, {'a': None}])
        record.update(new={'a': 'b'})

    assert 'new_number' in read_result(changed(result, add, 'newer')).numbers()
