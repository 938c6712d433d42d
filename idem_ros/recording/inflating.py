"""Compressed bytes inflated as far as they say themselves, and never beyond a bound."""

import bz2
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import lz4.frame
import zstandard

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.folder import bare_name
from idem_ros.terminal.printable import error_line

MAGICS = {b'\x28\xb5\x2f\xfd': 'zstd', b'\x04\x22\x4d\x18': 'lz4'}
"""How a file or a message begins that is compressed as a whole; CDR begins with a zero."""
LONGEST_HEAD = 19  # bytes that say how much there is
PIECE = 2**20  # bytes
LARGEST_RATIO = 1000  # of a file as a whole; clouds come to ten


class TooLarge(IdemError):
    """Compressed bytes that declare or inflate to more than the bound."""


class Damaged(IdemError):
    """Bytes that are not what they should be."""


def compression_of(head):
    """Return how bytes are compressed, by the first four of them; empty: they are not."""
    return MAGICS.get(bytes(head[:4]), '')


def inflated(content, compression, size, bound):
    """Return what a chunk holds.

    Args:
        content: its bytes.
        compression: '', 'none', 'zstd', 'lz4' or 'bz2'.
        size: what it declares to inflate to [bytes].
        bound: see `TooLarge`.

    Raises:
        TooLarge: before it is inflated.
        Damaged: it is no such content, or holds more or less than it declares.
    """
    if size > bound:
        raise TooLarge(f'{size} bytes, more than --max-chunk {bound}')
    if compression in ('', 'none'):
        result = content
    else:
        try:
            result = _INFLATERS[compression](content, size + 1)
        except KeyError:
            raise Damaged(f'its compression {compression[:40]!r} is not known') from None
        except Exception as error:  # of four libraries, each with its own
            raise Damaged(error_line(error)) from error
    if len(result) != size:
        more = 'more than' if len(result) > size else f'{len(result)} of'
        raise Damaged(f'it holds {more} the {size} bytes it declares')
    return result


def inflated_message(raw, bound):
    """Return a message that may be compressed by itself, as rosbag2 does on demand.

    Raises:
        TooLarge, Damaged: see `inflated`.
    """
    compression = compression_of(raw)
    if not compression:
        return raw
    try:
        size = _SIZES[compression](bytes(raw[:LONGEST_HEAD]))
        if size is not None:
            return inflated(raw, compression, size, bound)
        result = _INFLATERS[compression](raw, bound + 1)
    except (zstandard.ZstdError, RuntimeError) as error:
        raise Damaged(error_line(error)) from error
    if len(result) > bound:
        raise TooLarge(f'more than --max-chunk {bound} bytes')
    return result


@contextmanager
def inflated_file(path, compression, bound):
    """Yield the path of a compressed file's content, in a folder that is gone afterwards.

    Args:
        path: the file.
        compression: one of `MAGICS`.
        bound: [bytes]; a file may inflate to `LARGEST_RATIO` times its size, where that is more.

    Raises:
        TooLarge: it inflates to more, or to more than the disk has room for.
        Damaged: it is not so compressed.
    """
    limit = max(bound, LARGEST_RATIO * path.stat().st_size)
    with TemporaryDirectory(prefix='idem_') as folder:
        limit = min(limit, shutil.disk_usage(folder).free - 64 * PIECE)
        inner = Path(folder) / bare_name(path.name)
        try:
            with path.open('rb') as stream, inner.open('wb') as out:
                _copy(_STREAMS[compression](stream), out, limit)
        except (zstandard.ZstdError, RuntimeError) as error:
            reason = error_line(error)
            raise Damaged(f'its compression by {compression} is damaged: {reason}') from error
        yield inner


def _copy(reader, out, limit):
    count = 0
    with reader, suppress(EOFError):  # of lz4 that is cut off: what came until there is kept
        while piece := reader.read1(PIECE):
            count += len(piece)
            if count > limit:
                raise TooLarge(f'it inflates to more than {limit} bytes')
            out.write(piece)


def _zstd_stream(stream):
    return zstandard.ZstdDecompressor().stream_reader(stream, read_across_frames=True)


def _zstd_size(head):
    size = zstandard.frame_content_size(head)
    return None if size < 0 else size


def _lz4_size(head):
    return lz4.frame.get_frame_info(head)['content_size'] or None


def _zstd(content, limit):
    # one call returns one block: ask until there is no more
    with zstandard.ZstdDecompressor().stream_reader(bytes(content)) as reader:
        return reader.read(limit)


def _lz4(content, limit):
    return lz4.frame.LZ4FrameDecompressor().decompress(content, max_length=limit)


def _bz2(content, limit):
    return bz2.BZ2Decompressor().decompress(content, max_length=limit)


_INFLATERS = {'zstd': _zstd, 'lz4': _lz4, 'bz2': _bz2}
_STREAMS = {'zstd': _zstd_stream, 'lz4': lz4.frame.LZ4FrameFile}
_SIZES = {'zstd': _zstd_size, 'lz4': _lz4_size}
