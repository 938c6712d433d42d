"""A db3 of rosbag2."""

import sqlite3
from collections import Counter

from idem_ros.recording.inflating import Damaged
from idem_ros.recording.part import NEVER, Channel, Logged

TOPICS = 'SELECT id, name, type, serialization_format FROM topics ORDER BY id'
DEFINITIONS = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
COUNTS = 'SELECT topic_id, count(*) FROM messages GROUP BY topic_id'
MESSAGES = (
    'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({}) ORDER BY timestamp'
)


class SqliteFile:
    """The messages of a db3; see `ChunkedFile` for the attributes.

    Raises:
        Damaged: it is no database, or none of rosbag2.
    """

    damage, left_out = '', ()

    def __init__(self, path):
        self.path = path
        try:
            # as it is on a disk that cannot be written; a view named messages could be anything
            uri = f'{path.absolute().as_uri()}?mode=ro&immutable=1'
            self._database = sqlite3.connect(uri, uri=True)
            self._database.text_factory = lambda text: text.decode('utf-8', 'replace')
        except sqlite3.Error as error:
            raise Damaged(str(error)) from error
        try:
            self._by_id = self._channels()
            counts = dict(self._database.execute(COUNTS))
            ((begin,),) = self._database.execute('SELECT min(timestamp) FROM messages')
        except (sqlite3.Error, ValueError, TypeError) as error:
            self.close()
            raise Damaged(str(error)) from error
        except BaseException:
            self.close()
            raise
        self.counts = Counter()
        for id_, channel in self._by_id.items():
            self.counts[channel] += counts.get(id_, 0)
        self.begin = NEVER if begin is None else int(begin)

    @property
    def channels(self):
        """[`Channel`] in the order of the file."""
        return list(self._by_id.values())

    def close(self):
        """Close the database."""
        self._database.close()

    def messages(self, channels):
        """Yield the `Logged` of some channels in log order.

        Raises:
            Damaged: what follows cannot be read.
        """
        ids = [id_ for id_, channel in self._by_id.items() if channel in channels]
        query = MESSAGES.format(','.join('?' * len(ids)))
        try:
            for id_, log_time, raw in self._database.execute(query, ids):
                yield Logged(int(log_time), self._by_id[id_], bytes(raw))
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise Damaged(str(error)) from error

    def _channels(self):
        tables = self._database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        tables = {name for (name,) in tables}
        if not {'messages', 'topics'} <= tables:
            raise Damaged('database missing tables')
        found = self._database.execute(DEFINITIONS) if 'message_definitions' in tables else ()
        definitions = {name: (form, text) for name, form, text in found}
        topics = list(self._database.execute(TOPICS))
        if not all(isinstance(each, str) for _, *words in topics for each in words):
            raise Damaged('a topic has no name, no type or no format')
        return {
            id_: Channel(name, kind, encoding, *definitions.get(kind, ('', '')))
            for id_, name, kind, encoding in topics
        }
