"""What an MCAP carries beside its messages: metadata and attached files."""

from dataclasses import dataclass
from pathlib import Path

from mcap.reader import make_reader

from idem_ros.core.exceptions import IdemError

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

    Returns:
        `Embedded`

    Raises:
        UnreadableMcap: it cannot be opened, or is damaged or cut off: its end is an index.
    """
    try:
        with Path(path).open('rb') as stream:
            return _embedded(path, stream)
    except OSError as error:
        raise UnreadableMcap(f'{path} cannot be read: {error.strerror or error}') from error


def _embedded(path, stream):
    try:
        reader = make_reader(stream, validate_crcs=True)
        return Embedded(
            {each.name: each.metadata for each in reader.iter_metadata()},
            _joined({each.name: each.data for each in reader.iter_attachments()}),
        )
    except Exception as error:  # damaged bytes raise anything: struct.error, OSError of a seek
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise UnreadableMcap(f'{path} is cut off or damaged: {reason}') from error


def _joined(pieces):
    """Return {name: content} of attachments of which some are pieces of others."""
    whole = {}
    while pieces:
        name, names = next(iter(pieces)), []
        while (piece := piece_name(name, len(names))) in pieces:
            names.append(piece)
        whole[name] = b''.join(pieces.pop(each) for each in names)
    return whole
