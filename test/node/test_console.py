"""What an operator reads: each thing when it changes, and not too often."""

from types import SimpleNamespace

import pytest

from idem_ros.core import Status, Verdict
from idem_ros.node.console import Console


class Lines(list):
    """A logger that keeps what is said."""

    def info(self, message):
        self.append(message)

    warning = info


@pytest.fixture
def lines():
    return Lines()


@pytest.fixture
def console(lines):
    return Console(lines)


def refinement(verdict, reason=''):
    said = SimpleNamespace(verdict=verdict, reason=reason) if verdict else None
    result = SimpleNamespace(assessment=said, status=Status.CONVERGED, converged=True)
    return SimpleNamespace(result=result, lost='')


GOOD = refinement(Verdict.ALIGNED)
BAD = refinement(Verdict.MISALIGNED, 'the clouds lie beside each other')


def test_what_is_waited_for_is_said_when_it_changes_and_after_a_minute(console, lines):
    texts = [
        'waiting for target',
        'waiting for target',
        'waiting for source',
        'waiting for source; the newest is 5.25 s old',
        'waiting for source; the newest is 6.25 s old',
    ]
    for now, text in enumerate(texts):
        console.waiting(text, float(now))
    assert lines == [texts[0], texts[2], texts[3]]
    console.waiting(texts[-1], 62.9)
    console.waiting(texts[-1], 63.1)
    assert lines[3:] == [texts[-1]]


def test_wait_after_a_result_is_said_again(console, lines):
    console.waiting('waiting for source', 0.0)
    console.result(GOOD, 1.0)
    console.waiting('waiting for source', 8.0)
    assert lines == ['waiting for source'] * 2


def test_bad_verdict_is_a_warning_at_once_and_then_every_few_seconds_with_their_number(
    console, lines
):
    for i in range(60):
        console.result(GOOD if i % 2 else BAD, i / 10)
    first, second = lines
    assert first == 'misaligned: the clouds lie beside each other'
    assert second == f'{first} (25 of the last 50 results)'


def test_good_results_are_not_talked_of(console, lines):
    for i in range(100):
        console.result(GOOD, float(i))
    assert lines == []


def test_drops_and_losses_are_said_every_few_seconds_with_their_number(console, lines):
    console.load(0, 0, 0.5, 100.0)
    for i in range(1, 12):
        console.load(4 * i, i, 0.97, 100.0 + i)
    drops, losses, *later = lines
    assert drops.startswith(
        '20 sources were dropped in the last 5 s: the worker is busy 97 %'[:-2]
    )
    assert losses.startswith('5 messages were lost on the way in the last 5 s')
    assert len(later) == 2


def test_nothing_is_said_of_drops_where_there_are_none(console, lines):
    for i in range(20):
        console.load(0, 0, 0.1, float(i))
    assert lines == []


def test_drops_long_after_others_are_of_the_time_since_they_began(console, lines):
    for i in range(40):
        console.load(max(i - 30, 0), 0, 0.9, float(i))
    assert [line.partition(':')[0] for line in lines] == ['5 sources were dropped in the last 5 s']


def test_at_the_end_it_says_how_many_were_aligned(console, lines):
    for i in range(15):
        console.result(GOOD if i < 2 else BAD, 0.0)
    lines.clear()
    console.farewell(received=20, refused=3, dropped=2)
    assert lines == ['of 20 sources 15 answered: 2 aligned, 13 not; 3 refused, 2 dropped']


def test_without_a_verdict_the_end_tells_of_convergence(console, lines):
    console.result(refinement(None), 0.0)
    console.farewell(received=1, refused=0, dropped=0)
    assert lines == ['of 1 sources 1 answered: 1 converged, 0 not; 0 refused, 0 dropped']


def test_each_kind_of_refusal_is_said_at_once_and_then_every_few_seconds_with_its_number(
    console, lines
):
    for i in range(60):
        console.refused(f'source: its data holds {i} bytes', i / 10)
        if i == 30:
            console.refused('target: it has no field x', i / 10)
    assert lines == [
        'refused: source: its data holds 0 bytes',
        'refused: target: it has no field x',
        'refused: source: its data holds 50 bytes (50 times in the last 5 s)',
    ]


def test_refusals_of_more_kinds_than_can_be_read_do_not_flood_the_console(console, lines):
    for i in range(1000):
        console.refused(f'the guess has frame_id lidar_{i}', i / 100)
    assert len(lines) < 40


def test_drops_before_the_first_report_are_not_of_the_time_since_the_machine_started(
    console, lines
):
    console.load(3, 0, 0.5, 60_000.0)
    console.load(3, 0, 0.5, 60_005.0)
    assert lines[0].startswith('3 sources were dropped in the last 5 s')
