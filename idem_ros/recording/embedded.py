"""What an MCAP carries beside its messages: metadata and attached files."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from idem_ros.core.exceptions import IdemError
from idem_ros.files.unreadable import refuse_special
from idem_ros.terminal.printable import error_line

METADATA, RECORD = 'idem_replay', 'frames.json'
"""What a result carries: metadata on how it was made, and the very file that --json writes."""
MAGIC = b'\x89MCAP0\r\n'


class UnreadableMcap(IdemError):
    """An MCAP whose metadata and attachments cannot be read."""


@dataclass(frozen=True)
class Embedded:
    """What is embedded in a recording."""

    metadata: dict[str, dict[str, str]]
    """By name; of equal names the last."""
    attachments: dict[str, bytes]
    """By name, pieces together; of equal names the last."""


def piece_name(name, k):
    """Return the name of the k-th piece of an attachment, from 0 on: NAME, NAME.2, NAME.3."""
    return f'{name}.{k + 1}' if k else name


def read_embedded(path):
    """Read the metadata and attachments of an MCAP, without its messages.

    By the index at its end: no chunk is read or inflated, and each record is read once.

    Returns:
        `Embedded`

    Raises:
        UnreadableMcap: it cannot be opened, is damaged or cut off, or has no index.
    """
    refuse_special(path, UnreadableMcap)
    try:
        with Path(path).open('rb') as stream:
            return _embedded(path, stream)
    except OSError as error:
        raise UnreadableMcap(f'{path} cannot be read: {error.strerror or error}') from error


def ends_whole(stream):
    """Return whether a stream ends as an MCAP does."""
    stream.seek(0, io.SEEK_END)
    stream.seek(max(stream.tell() - len(MAGIC), 0))
    return stream.read(len(MAGIC)) == MAGIC


def _embedded(path, stream):
    try:
        if not ends_whole(stream):
            raise ValueError('its end is missing')
        stream.seek(0)
        summary = make_reader(stream, validate_crcs=True).get_summary()
        if summary is None:
            raise ValueError('it has no index')
        metadata = [_record_at(stream, at) for at in _offsets(summary.metadata_indexes)]
        attachments = [_record_at(stream, at) for at in _offsets(summary.attachment_indexes)]
        return Embedded(
            {each.name: each.metadata for each in metadata},
            _joined({each.name: each.data for each in attachments}),
        )
    except Exception as error:  # damaged bytes raise anything: struct.error, OSError of a seek
        reason = error_line(error)
        raise UnreadableMcap(f'{path} is cut off or damaged: {reason}') from error


def _offsets(indexes):
    """Return where records are, each once: an index may name one a million times."""
    return dict.fromkeys(each.offset for each in indexes)


def _record_at(stream, offset) -> Any:
    stream.seek(offset)
    return next(StreamReader(stream, skip_magic=True, emit_chunks=True).records)


def _joined(pieces):
    """Return {name: content} of attachments of which some are pieces of others."""
    whole = {}
    while pieces:
        name, names = next(iter(pieces)), []
        while (piece := piece_name(name, len(names))) in pieces:
            names.append(piece)
        whole[name] = b''.join(pieces.pop(each) for each in names)
    return whole
