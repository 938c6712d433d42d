from idem_ros.messages.point_times import NO_FIELD, TimesRead
from idem_ros.refinement.times_said import TimesSaid

NONE = TimesRead(None, NO_FIELD)
READ = TimesRead([0.0, 0.1], 'field t (uint32) in ns')


def test_how_times_are_read_is_said_once():
    said = TimesSaid()
    assert said.news(target=NONE, source=READ) == 'source: field t (uint32) in ns'
    assert said.news(target=NONE, source=READ) == ''
    assert said.notes == ['sweeps: source: field t (uint32) in ns']


def test_clouds_that_lack_times_where_others_have_them_are_said_to_be_without():
    said = TimesSaid()
    said.news(source=READ)
    assert said.news(source=NONE) == f'source: {NO_FIELD}; taken as none'
    assert said.news(source=READ) == 'source: field t (uint32) in ns'


def test_a_stream_that_never_had_times_is_no_news():
    said = TimesSaid()
    assert said.news(target=NONE, source=TimesRead(None, '')) == ''
    assert said.notes == []


def test_notes_that_differ_in_numbers_only_are_one():
    said = TimesSaid()
    for count in range(9):
        said.news(source=TimesRead(None, f'{count} of 400 are not finite'))
    assert said.notes == ['sweeps: source: 0 of 400 are not finite; taken as none']
