"""A db3 of rosbag2: as a database, or where that is cut off row after row."""

import shutil
import sqlite3
from collections import Counter
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from idem_ros.recording.inflating import Damaged
from idem_ros.recording.part import NEVER, Channel, Logged

TOPICS = 'SELECT id, name, type, serialization_format FROM topics ORDER BY id'
DEFINITIONS = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
COUNTS = 'SELECT topic_id, count(*) FROM messages GROUP BY topic_id'
BEGIN = f'SELECT min(timestamp) FROM messages WHERE timestamp BETWEEN {-NEVER} AND {NEVER}'
MESSAGES = (
    'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({}) ORDER BY timestamp'
)
ROWS = 'SELECT topic_id, timestamp, rowid FROM messages NOT INDEXED'
ROW = 'SELECT data FROM messages WHERE rowid = ?'
UNFINISHED = '-wal', '-journal'
"""What a recorder that was killed leaves beside a database: the last messages, or how to undo."""


class SqliteFile:
    """The messages of a db3; see `ChunkedFile` for the attributes.

    Raises:
        Damaged: it is no database, or none of rosbag2.
    """

    magic = b'SQLite format 3\0'
    left_out = ()

    def __init__(self, path, max_chunk=None):
        self.path, self.damage, self._rows = path, '', []
        self.bytes_read = path.stat().st_size
        with ExitStack() as stack:
            try:
                self._database = stack.enter_context(_opened(path))
                counts, begin = self._counted()
            except (sqlite3.Error, ValueError, TypeError) as error:
                raise Damaged(str(error)) from error
            self._open = stack.pop_all()
        self.begin, self.counts = NEVER if begin is None else int(begin), Counter()
        for id_, channel in self._by_id.items():
            self.counts[channel] += counts.get(id_, 0)

    @property
    def channels(self):
        """[`Channel`] in the order of the file."""
        return list(self._by_id.values())

    def close(self):
        """Close the database."""
        self._open.close()

    def messages(self, channels):
        """Yield the `Logged` of some channels in log order.

        Raises:
            Damaged: what follows cannot be read, or some of it is no message.
        """
        ids = [id_ for id_, channel in self._by_id.items() if channel in channels]
        torn = 0
        try:
            for id_, log_time, raw in self._found(ids):
                if type(log_time) is int and type(raw) is bytes:
                    yield Logged(log_time, self._by_id[id_], raw)
                else:
                    torn += 1
        except sqlite3.Error as error:
            raise Damaged(str(error)) from error
        if torn:
            raise Damaged(f'{torn} rows have no time or hold no bytes')

    def _found(self, ids):
        """Yield (topic's number, log time, bytes) of some topics."""
        if not self.damage:
            yield from self._database.execute(MESSAGES.format(','.join('?' * len(ids))), ids)
        wanted = frozenset(ids)
        for log_time, row, id_ in sorted(self._rows):
            if id_ in wanted:
                ((raw,),) = self._database.execute(ROW, [row])
                yield id_, log_time, raw

    def _counted(self):
        """Return ({topic's number: messages}, the earliest log time [ns] or None).

        Of a database that is cut off it counts the rows as far as they go, and keeps their places.
        """
        try:
            self._by_id = self._channels()
            ((begin,),) = self._database.execute(BEGIN)
            return dict(self._database.execute(COUNTS)), begin
        except sqlite3.DatabaseError as error:
            self.damage = str(error)
        # else nothing is read of a file that is shorter than it says
        self._database.execute('PRAGMA writable_schema = ON')
        self._by_id = self._channels()
        with suppress(sqlite3.DatabaseError):  # it ends there
            for id_, log_time, row in self._database.execute(ROWS):
                if type(log_time) is int:
                    self._rows.append((log_time, row, id_))
        begin = min((log_time for log_time, *_ in self._rows), default=None)
        return Counter(id_ for *_, id_ in self._rows), begin

    def _channels(self):
        tables = self._database.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table' AND rootpage > 0"
        )
        tables = {name for (name,) in tables}
        if not {'messages', 'topics'} <= tables:
            raise Damaged('it is a database without the tables of rosbag2, topics and messages')
        columns = self._database.execute("SELECT hidden FROM pragma_table_xinfo('messages')")
        if any(hidden for (hidden,) in columns):
            raise Damaged('its table of messages computes what it should hold')
        found = self._database.execute(DEFINITIONS) if 'message_definitions' in tables else ()
        definitions = {
            name: said for name, *said in found if all(isinstance(each, str) for each in said)
        }
        topics = list(self._database.execute(TOPICS))
        if not all(isinstance(each, str) for _, *words in topics for each in words):
            raise Damaged('a topic has no name, no type or no format')
        return {
            id_: Channel(name, kind, encoding, *definitions.get(kind, ('', '')))
            for id_, name, kind, encoding in topics
        }


@contextmanager
def _opened(path):
    """Yield a database that is not written to; what its recorder left beside it is taken in."""
    with ExitStack() as stack:
        beside = [Path(f'{path}{suffix}') for suffix in UNFINISHED]
        beside = [each for each in beside if each.is_file() and each.stat().st_size]
        if beside:
            # SQLite would finish it in place
            folder = Path(stack.enter_context(TemporaryDirectory(prefix='idem_')))
            path = [shutil.copyfile(each, folder / each.name) for each in (path, *beside)][0]
        # as it is on a disk that cannot be written; a view named messages could be anything
        options = '' if beside else '?mode=ro&immutable=1'
        uri = f'{path.absolute().as_uri()}{options}'
        database = stack.enter_context(closing(sqlite3.connect(uri, uri=True)))
        database.text_factory = lambda text: text.decode('utf-8', 'replace')
        yield database
