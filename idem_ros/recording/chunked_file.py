"""A file of chunks: read by its index, or where that is missing or damaged, chunk after chunk."""

from collections import Counter
from typing import Any

from idem_ros.recording.inflating import Damaged, TooLarge
from idem_ros.recording.part import MAX_CHUNK, NEVER, Block, ClippedFile, Logged, in_log_order
from idem_ros.terminal.printable import error_line


class ChunkedFile:
    """The messages of a file.

    A format says its `magic` and `kind`, and has `_index` (takes channels, counts and blocks from
    the index, and returns whether it has them all), `_scan` (finds them without one), `_checked`
    (returns the records of the chunk at an offset) and `_messages_in` (yields channel's number,
    log time and bytes of records).

    Args:
        path: the file.
        max_chunk: chunks that declare to inflate to more are left out [bytes].

    Attributes:
        channels: [`Channel`].
        counts: {`Channel`: messages} that it should have.
        begin: the earliest log time [ns].
        damage: why it was read without its index; empty where that is in order or was not made.
        bytes_read: how far it could be read then.
        left_out: [why a chunk was left out] so far.

    Raises:
        Damaged: it is none of its kind.
    """

    magic, kind = b'', ''
    _index: Any
    _scan: Any
    _checked: Any
    _messages_in: Any

    def __init__(self, path, max_chunk=MAX_CHUNK):
        self.path, self._max_chunk = path, max_chunk
        self.damage, self.left_out, self.counts = '', [], Counter()
        self._by_id, self._blocks, self._bad = {}, [], set()
        self._stream = ClippedFile(path)
        self.bytes_read = self._stream.size
        try:
            if self._stream.read(len(self.magic)) != self.magic:
                raise Damaged(f'its magic is not that of {self.kind}')
            if not self._index():
                self._scan()
        except BaseException:
            self.close()
            raise
        self.begin = min((block.begin for block in self._blocks), default=NEVER)

    @property
    def channels(self):
        """[`Channel`] in the order of the file."""
        return list(self._by_id.values())

    def close(self):
        """Close the file."""
        self._stream.close()

    def messages(self, channels):
        """Yield the `Logged` of some channels in log order."""
        ids = {id_ for id_, channel in self._by_id.items() if channel in channels}
        blocks = [b for b in self._blocks if b.channels is None or b.channels & ids]
        yield from in_log_order(blocks, lambda block: self._read(block, ids))

    def _read(self, block, ids):
        """Return the `Logged` of a block; none of one that is damaged, which is named."""
        if block.offset in self._bad:
            return []
        try:
            content = self._content(block.offset)
            found = [each for each in self._messages_in(content) if each[0] in ids]
            if any(log_time < block.begin for _, log_time, _ in found):
                raise Damaged('it holds messages of before the time that its index tells')
        except Exception as error:  # damaged bytes raise anything
            self._leave_out(block.offset, error)
            return []
        # what is kept keeps the whole chunk: where that is much more, it is copied out
        is_much = sum(len(raw) for *_, raw in found) * 2 > len(content)
        kept = (lambda raw: raw) if is_much else bytes
        return [Logged(time, self._by_id[id_], kept(raw)) for id_, time, raw in found]

    def _content(self, offset):
        """Return the records of a chunk as bytes.

        Raises:
            Damaged: it is, or is too large; the first time it is added to what was left out.
        """
        try:
            return self._checked(offset)
        except Exception as error:  # damaged bytes raise anything
            self._leave_out(offset, error)
            raise Damaged(error_line(error)) from error

    def _leave_out(self, offset, error):
        if offset not in self._bad:
            self._bad.add(offset)
            self.left_out.append(f'the chunk at byte {offset}: {error_line(error)}')

    def _require_small(self, size):
        if size > self._max_chunk:
            raise TooLarge(f'it declares {size} bytes, more than --max-chunk {self._max_chunk}')

    def _take_chunk(self, offset):
        """Take a chunk that no index tells of; return whether it has messages.

        Raises:
            Damaged: see `_content`.
        """
        times, ids = [], set()
        for id_, log_time, _ in self._messages_in(self._content(offset)):
            if id_ in self._by_id:
                self.counts[self._by_id[id_]] += 1
                times.append(log_time)
                ids.add(id_)
        if times:
            self._blocks.append(Block(min(times), max(times), offset, frozenset(ids)))
        return bool(times)
