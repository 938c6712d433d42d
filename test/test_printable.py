import pytest

from idem_ros.printable import MOST, message_line, printable


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
