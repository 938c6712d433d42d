import json

import pytest
from recordings import scans

from idem_ros.core import RegistrationConfig
from idem_ros.evaluation.one_recording import Task, evaluated, identity
from idem_ros.recording.folder import fingerprint
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.settings import Settings, from_record


@pytest.fixture
def bag(tmp_path, rng):
    write_mcap(tmp_path / 'scans.mcap', scans(rng))
    return tmp_path / 'scans.mcap'


def test_the_outcome_is_the_json_of_a_replay_that_says_how_it_was_made(bag):
    settings = Settings(RegistrationConfig(voxel_size=0.1))
    outcome = evaluated(Task(str(bag), settings, {'source_topic': 'source'}))
    record = json.loads(outcome.text)
    assert outcome.reason == ''
    assert record['bag'] == outcome.path == str(bag)
    assert record['summary']['frames'] == len(record['frames']) == 3
    made_by = record['made_by']
    assert made_by['input'] == fingerprint(bag)
    assert outcome.identity == identity(fingerprint(bag))
    others = {key: made_by[key] for key in made_by if key not in ('versions', 'input', 'topics')}
    assert from_record(others) == settings


def test_what_is_there_is_not_done_again_and_what_differs_is(bag):
    key = identity(fingerprint(bag))
    assert evaluated(Task(str(bag), Settings(), {}, frozenset([key]))).text is None
    assert evaluated(Task(str(bag), Settings(), {}, frozenset([key[:-1]]))).text


@pytest.mark.parametrize(
    ('topics', 'reason'), [({}, 'does not exist'), ({'source_topic': '/x'}, "no topic '/x'")]
)
def test_what_is_wrong_with_a_recording_is_told_not_raised(bag, topics, reason):
    path = bag if topics else bag.with_name('other.mcap')
    outcome = evaluated(Task(str(path), Settings(), topics))
    assert reason in outcome.reason
    assert str(path) in outcome.reason
    assert outcome.text is None


def test_a_replay_that_was_interrupted_is_no_result(bag):
    def interrupt(messages, total):
        yield from (message for message, _ in zip(messages, range(4), strict=False))
        raise KeyboardInterrupt

    outcome = evaluated(Task(str(bag), Settings(), {}), interrupt)
    assert (outcome.text, outcome.reason) == (None, 'interrupted before it was done')
