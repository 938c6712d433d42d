import os

import pytest

from idem_ros.files.structured_text import (
    MOST_VALUES,
    MOST_YAML,
    UnreadableText,
    parse_json,
    read_yaml,
)

NINE = ','.join(['*{0}'] * 9)


def bomb(levels=10):
    """Return lists of nine times the list before: 9^levels values in a kilobyte."""
    lines = ['a0: &a0 [1,1,1,1,1,1,1,1,1]']
    lines += [f'a{i}: &a{i} [{NINE.format(f"a{i - 1}")}]' for i in range(1, levels)]
    return '\n'.join(lines)


def merged(levels=10):
    """Return mappings that take in the mapping before nine times."""
    lines = ['a0: &a0 {k: 1}']
    lines += [f'a{i}: &a{i} {{<<: [{NINE.format(f"a{i - 1}")}]}}' for i in range(1, levels)]
    return '\n'.join(lines)


@pytest.fixture
def refused(tmp_path):
    def read(text):
        path = tmp_path / 'some.yaml'
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(UnreadableText) as error:
            read_yaml(path)
        assert str(error.value).startswith(f'{path} ')
        assert '\n' not in str(error.value)
        assert len(str(error.value)) < len(str(path)) + 300
        return str(error.value)

    return read


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (bomb(), f'more than {MOST_VALUES} values'),
        (merged(), f'more than {MOST_VALUES} values'),
        ('a: ' + '[' * 500 + ']' * 500, 'deeper than'),
        ('a: ' + '[' * 5000 + ']' * 5000, 'depth'),
        ('a: ' + '{b: ' * 500 + '1' + '}' * 500, 'deeper than'),
        ('- ' * 3000 + 'a', 'deeper than'),
        ('a: &s\n  b: *s\n', 'holds itself'),
        ('&s [*s]', 'holds itself'),
        ('a: &s [1]\nb: &s [*s]', 'holds itself'),
        ('a: *nothing', 'holds itself, or nothing'),
        ('a: 1' + '0' * 5000, 'is no YAML'),
        ('a: 0x' + 'f' * 5000, 'more than 64 bits'),
        ('a: 9223372036854775808', 'more than 64 bits'),
        ('a: ' + '1' + ':59' * 500, 'more than 64 bits'),
        ('1: a', 'a name is 1; it must be a word'),
        ('a: {null: 1}', 'a name is None'),
        ('a: {[1, 2]: 1}', 'a name is a list or a mapping'),
        ('a: {{b: c}: 1}', 'a name is a list or a mapping'),
        ('a: 1\na: 2', "'a' is said twice"),
        ('a: !!python/object/apply:os.system [true]', 'is no YAML'),
        ('a: !!python/name:os.system', 'is no YAML'),
        ('a: ' + 'x' * MOST_YAML, f'larger than {MOST_YAML} bytes'),
        (b'a: \xff', 'is no YAML'),
        ('a: \x00', 'is no YAML'),
        ('a: 1\n---\nb: 2', 'is no YAML'),
        ('a: 2001-99-99', 'is no YAML'),
    ],
)
def test_yaml_that_nobody_can_mean_is_refused_in_one_line(refused, text, words):
    assert words in refused(text)


def test_yaml_that_people_write_is_read(tmp_path):
    (tmp_path / 'a.yaml').write_text(
        'a: &a [1, -2.5, .inf, 1e3]\nb: *a\nc: {d: yes, e: ~, f: 2020-01-01}\n"g": é\n'
    )
    assert read_yaml(tmp_path / 'a.yaml') == {
        'a': [1, -2.5, float('inf'), '1e3'],
        'b': [1, -2.5, float('inf'), '1e3'],
        'c': {'d': True, 'e': None, 'f': '2020-01-01'},
        'g': 'é',
    }
    (tmp_path / 'b.yaml').write_text('base: &b {x: 1}\nother: {<<: *b, y: 2}')
    assert read_yaml(tmp_path / 'b.yaml')['other'] == {'x': 1, 'y': 2}


def test_a_fifo_that_nobody_writes_to_and_an_endless_device_do_not_hang(tmp_path):
    os.mkfifo(tmp_path / 'fifo')
    assert read_yaml(tmp_path / 'fifo') is None
    with pytest.raises(UnreadableText, match='larger than'):
        read_yaml('/dev/zero')


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('[' * 100_000, 'deeper than'),
        ('[' * 100 + ']' * 100, 'deeper than'),
        ('{"a": ' * 100 + '1' + '}' * 100, 'deeper than'),
        ('{"a": 1, "a": 2}', "'a' is said twice"),
        ('[NaN]', 'NaN is no number'),
        ('[-Infinity]', '-Infinity is no number'),
        ('[1e999]', '1e999 is no number'),
        ('[' + '9' * 100_000 + ']', 'is no number'),
        ('[9223372036854775808]', 'is no number'),
        ('\ufeff{}', 'BOM'),
        ('[1', 'Expecting'),
    ],
)
def test_json_that_no_record_is_is_refused_in_one_line(text, words):
    with pytest.raises(ValueError, match='.') as error:
        parse_json(text.encode())
    assert words in str(error.value)
    assert '\n' not in str(error.value)
    assert len(str(error.value)) < 200


def test_many_names_of_which_the_last_comes_twice_take_no_square_of_time():
    names = [*(f'"n{i}": 1' for i in range(200_000)), '"n199999": 2']
    with pytest.raises(ValueError, match="'n199999' is said twice"):
        parse_json(f'{{{", ".join(names)}}}'.encode())


def test_json_keeps_what_it_says():
    text = b'{"a": [1, 1.5, null, true, "x", -9223372036854775808], "b": {}}'
    assert parse_json(text) == {'a': [1, 1.5, None, True, 'x', -(2**63)], 'b': {}}
