"""A db3 is read as its recorder left it: killed, cut off, with rows that are no messages."""

import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from recordings import scans, write_sqlite3

from idem_ros.recording.folder import UnreadableRecording
from idem_ros.recording.reader import open_recording

KILLED = """
import os, sqlite3, sys
database = sqlite3.connect(sys.argv[1])
rows = list(database.execute('SELECT topic_id, timestamp, data FROM messages ORDER BY id'))
database.execute('DELETE FROM messages WHERE id > 4')
database.commit()
database.execute('PRAGMA journal_mode = WAL')
database.execute('PRAGMA wal_autocheckpoint = 0')
database.executemany('INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)', rows[4:])
database.commit()
os._exit(9)
"""


@pytest.fixture
def messages(rng):
    return list(scans(rng, n=6, points=3000))


@pytest.fixture
def file(tmp_path, messages):
    write_sqlite3(tmp_path / 'run', messages)
    return tmp_path / 'run/run.db3'


def changed(file, *commands):
    with closing(sqlite3.connect(file)) as database:
        for command in commands:
            database.execute(command)
        database.commit()


def read(path):
    with open_recording(path) as recording:
        logged = [each[:2] for each in recording.messages(recording.topics)]
        return logged, recording.warnings, +recording.lost


def test_the_log_that_a_killed_recorder_left_beside_it_is_read_and_left_alone(file, messages):
    subprocess.run([sys.executable, '-c', KILLED, str(file)], check=False)
    before = {path: path.read_bytes() for path in file.parent.iterdir()}
    assert len(before[file.with_name('run.db3-wal')])
    assert read(file) == ([each[:2] for each in messages], [], {})
    assert {path: path.read_bytes() for path in file.parent.iterdir()} == before


@pytest.mark.parametrize('kept', [0.5, 0.95])
def test_of_one_that_is_cut_off_the_rows_are_read_as_far_as_they_go(file, messages, kept):
    content = file.read_bytes()
    file.write_bytes(content[: int(kept * len(content))])
    logged, (warning,), lost = read(file)
    assert logged == [each[:2] for each in messages[: len(logged)]]
    assert kept * len(messages) - 4 <= len(logged) < len(messages)
    assert f'run.db3 is cut off or damaged (database disk image is malformed): {len(logged)}' in (
        warning
    )
    assert lost == {'files_damaged': 1}


def test_rows_that_are_no_messages_are_counted_and_the_others_are_read(file, messages):
    changed(
        file,
        'UPDATE messages SET data = 99999999999999 WHERE id = 3',
        "UPDATE messages SET data = 'text' WHERE id = 5",
        "UPDATE messages SET timestamp = 'never' WHERE id = 7",
    )
    logged, (warning,), lost = read(file)
    assert logged == [each[:2] for k, each in enumerate(messages, 1) if k not in (3, 5, 7)]
    assert '16 of 19 messages can be read (3 rows have no time or hold no bytes)' in warning
    assert lost == {'messages_left_out': 3}


def test_definitions_that_are_no_text_are_as_if_there_were_none(file, messages):
    changed(file, "UPDATE message_definitions SET encoded_message_definition = x'00ff'")
    assert len(read(file)[0]) == len(messages)


def test_a_table_that_computes_its_bytes_is_refused_before_they_are_made(file):
    changed(
        file,
        'ALTER TABLE messages RENAME TO before',
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
        'data BLOB GENERATED ALWAYS AS (zeroblob(900000000)) VIRTUAL)',
        'INSERT INTO messages(topic_id, timestamp) SELECT topic_id, timestamp FROM before',
    )
    with pytest.raises(UnreadableRecording, match='computes what it should hold'):
        read(file)


def test_a_database_of_something_else_says_what_it_lacks(tmp_path):
    changed(tmp_path / 'x.db3', 'CREATE TABLE birds(name TEXT)')
    with pytest.raises(UnreadableRecording, match='without the tables of rosbag2'):
        read(tmp_path / 'x.db3')
