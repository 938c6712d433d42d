import json

import pytest

from idem_ros.evaluation.overall import Overall, overall_table


def record(times, errors, refused=0, notes=()):
    frames = [
        {'time_ms': time, 'translation_error_m': error}
        for time, error in zip(times, errors, strict=True)
    ]
    summary = {'frames': len(frames), 'refused': refused, 'dropped': 1, 'unpaired': 0}
    return {'frames': frames, 'summary': summary, 'notes': list(notes)}


@pytest.fixture
def overall():
    result = Overall()
    result.add('b.mcap', record([1.0, 3.0, 5.0], [None, None, 0.5], notes=['cut off']), 'b.json')
    result.add('a.mcap', record([100.0], [0.1], refused=2))
    result.add_failure('c.mcap', 'c.mcap is empty')
    return result


def test_counts_are_summed_and_numbers_pooled_over_all_frames(overall):
    found = overall.record()
    assert (found['evaluated'], found['failed']) == (2, 1)
    pooled = found['pooled']
    assert [pooled[name] for name in ('frames', 'refused', 'dropped', 'unpaired')] == [4, 2, 2, 0]
    assert pooled['with_truth'] == 2
    assert pooled['time_ms']['median'] == 4.0  # of 1 3 5 100, not of two medians
    assert pooled['translation_error_m']['median'] == pytest.approx(0.3)
    assert pooled['rotation_error_deg'] == {'median': None, 'p90': None}
    json.dumps(found, allow_nan=False)


def test_recordings_are_in_the_order_of_their_names_each_with_its_result_or_reason(overall):
    a, b, c = overall.record()['recordings']
    assert (a['bag'], a['result'], a['time_ms']['median']) == ('a.mcap', None, 100.0)
    assert (b['bag'], b['result'], b['notes']) == ('b.mcap', 'b.json', ['cut off'])
    assert c == {'bag': 'c.mcap', 'reason': 'c.mcap is empty'}


def test_the_table_has_a_row_for_each_and_names_what_failed_and_what_to_know(overall):
    lines = overall_table(overall.record()).splitlines()
    assert [line.split()[1] for line in lines[2:5]] == ['a.mcap', 'b.mcap', 'all']
    assert 'note: b.mcap: cut off' in lines
    assert lines[-2:] == ['2 of 3 recordings evaluated', '  not evaluated: c.mcap is empty']


def test_of_nothing_there_is_no_table():
    overall = Overall()
    overall.add_failure('c.mcap', 'why')
    assert (
        overall_table(overall.record())
        == '0 of 1 recordings evaluated\n  not evaluated: c.mcap: why'
    )
