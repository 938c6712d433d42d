import pytest

from idem_ros.node.traffic import Traffic
from idem_ros.refinement.diagnostics import OK, STALE, WARN


@pytest.fixture
def traffic():
    return Traffic(('target', 'source'), now=0.0)


def test_nothing_that_came_is_stale(traffic):
    load = traffic.load(10.0, dropped=0, counts={}, inputs=('source',))
    assert (load.level, load.reason) == (STALE, 'no source has come in the last 5 s')
    assert (load.values['source_hz'], load.values['stamp_to_receipt_s']) == ('0.00', 'nan')
    assert 'target_hz' not in load.values


def test_rates_delays_and_counts_are_those_of_what_was_noted(traffic):
    for i in range(20):
        now = 6.0 + i * 0.2
        traffic.note_input('source', now, lag=0.05)
        traffic.worker.begin(now)
        traffic.worker.end(now + 0.1)
        traffic.note_answer(now + 0.1, since_receipt=0.1 if i else 0.3)
    traffic.note_input('target', 9.0, lag=None)
    load = traffic.load(10.0, dropped=0, counts={'waiting': 0}, inputs=('target', 'source'))
    assert (load.level, load.reason) == (OK, 'no source is dropped')
    assert load.values == {
        'target_hz': '0.20',
        'source_hz': '4.00',
        'target_lost': '0',
        'source_lost': '0',
        'result_hz': '4.00',
        'stamp_to_receipt_s': '0.0500',
        'stamp_to_receipt_max_s': '0.0500',
        'receipt_to_publication_s': '0.1100',
        'receipt_to_publication_max_s': '0.3000',
        'utilisation': '0.400',
        'received': '20',
        'answered': '20',
        'waiting': '0',
        'dropped': '0',
    }


def test_sources_dropped_since_the_last_report_are_a_warning(traffic):
    traffic.note_input('source', 1.0, lag=0.0)
    assert traffic.load(2.0, dropped=3, counts={}, inputs=('source',)).level == WARN
    load = traffic.load(3.0, dropped=5, counts={}, inputs=('source',))
    assert load.level == WARN
    assert load.reason.startswith('2 sources were dropped')
    assert traffic.load(4.0, dropped=5, counts={}, inputs=('source',)).level == OK


@pytest.mark.parametrize(('lag', 'way'), [(3.0e7, 'behind'), (-100.0, 'ahead of')])
def test_stamps_of_another_clock_are_told(traffic, lag, way):
    traffic.note_input('source', 1.0, lag)
    load = traffic.load(2.0, dropped=0, counts={}, inputs=('source',))
    assert load.level == OK
    assert f'{abs(lag):.3g} s {way} the clock of the node' in load.reason


def test_source_without_a_stamp_has_no_delay(traffic):
    traffic.note_input('source', 1.0, lag=None)
    traffic.note_answer(1.1, since_receipt=None)
    load = traffic.load(2.0, dropped=0, counts={}, inputs=('source',))
    assert load.values['stamp_to_receipt_s'] == load.values['receipt_to_publication_s'] == 'nan'
    assert (load.values['received'], load.values['answered']) == ('1', '1')


def test_messages_lost_on_the_way_are_a_warning_that_says_what_helps(traffic):
    traffic.note_lost('target', 2)
    traffic.note_lost('source', 1)
    load = traffic.load(2.0, dropped=0, counts={}, inputs=('target', 'source'))
    assert load.level == WARN
    assert load.reason.startswith('3 messages were lost on the way')
    assert (load.values['target_lost'], load.values['source_lost']) == ('2', '1')
    assert traffic.load(3.0, dropped=0, counts={}, inputs=('source',)).level == STALE
