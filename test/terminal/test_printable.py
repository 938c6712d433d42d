import io

import pytest

from idem_ros.terminal.printable import MOST, ShownStream, cell, message_line, printable


@pytest.mark.parametrize(
    ('text', 'shown'),
    [
        ('/lidar/points', '/lidar/points'),
        ('Größe 点群 🚗', 'Größe 点群 🚗'),
        ('\x1b[31mred', '\\x1b[31mred'),
        ('a\nb\r\tc', 'a\\nb\\r\\tc'),
        ('\x9b31m', '\\x9b31m'),
        ('a\u202egnp.exe', 'a\\u202egnp.exe'),
        ('a\u2066b\u200bc', 'a\\u2066b\\u200bc'),
        ('a\u2028b\x85c', 'a\\u2028b\\x85c'),
        ('sc\udcffn', 'sc\\udcffn'),
        ('\x00\x07', '\\x00\\x07'),
    ],
)
def test_what_a_terminal_obeys_or_hides_becomes_an_escape(text, shown):
    assert printable(text) == shown


def test_a_long_message_keeps_its_beginning_and_its_end():
    line = message_line('begin\n' + 'x' * 10**6 + 'end')
    assert line.startswith('begin\\nxxx')
    assert line.endswith('xxxend')
    assert len(line) < MOST + 10


@pytest.mark.parametrize(
    ('value', 'shown'),
    [
        ('=HYPERLINK("http://a")', '\'=HYPERLINK("http://a")'),
        ('+1+1', "'+1+1"),
        ('-2+3', "'-2+3"),
        ('@SUM(A1)', "'@SUM(A1)"),
        ('\t=1', "'\\t=1"),
        ('\r=1', "'\\r=1"),
        ('＝1+1', "'＝1+1"),
        ('-1, -1', "'-1, -1"),
        ('-1.5', '-1.5'),
        ('-inf', '-inf'),
        ('a=b', 'a=b'),
        ('a\nb', 'a\\nb'),
        (-1.5, -1.5),
        (None, None),
        (True, True),
    ],
)
def test_no_text_of_a_csv_is_a_formula_and_numbers_stay_numbers(value, shown):
    assert cell(value) == shown
    assert type(cell(value)) is type(shown)


def test_a_stream_lets_lines_through_and_nothing_that_a_terminal_obeys():
    written = io.StringIO()
    print('a\tb\n\x1b[2Jc\u202ed', file=ShownStream(written))
    assert written.getvalue() == 'a\tb\n\\x1b[2Jc\\u202ed\n'
