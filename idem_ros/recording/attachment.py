"""Attach a file to an MCAP that is being written, without taking all of it into memory."""

import io
import struct
import zlib

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex

PIECE = 2**20  # bytes


def attach(writer, stream, name, media_type, content):
    """Append an attachment; mcap's own `add_attachment` holds three copies of what it is given.

    Its times are 0, "not known": the same content gives the same bytes.

    Args:
        writer: the `mcap.writer.Writer` of the stream; chunked, so it keeps back no record.
        stream: the file it writes.
        name, media_type: of the attachment.
        content: a binary file, read from its beginning.
    """
    size, offset = content.seek(0, io.SEEK_END), stream.tell()
    content.seek(0)
    texts = (text.encode() for text in (name, media_type))
    head = struct.pack('<QQ', 0, 0)
    head += b''.join(struct.pack('<I', len(text)) + text for text in texts)
    head += struct.pack('<Q', size)
    stream.write(struct.pack('<BQ', Opcode.ATTACHMENT, len(head) + size + 4) + head)
    crc = zlib.crc32(head)
    while piece := content.read(PIECE):
        stream.write(piece)
        crc = zlib.crc32(piece, crc)
    stream.write(struct.pack('<I', crc))
    # what it has no method for: the index without which no reader finds the attachment
    writer._Writer__statistics.attachment_count += 1
    writer._Writer__attachment_indexes.append(
        AttachmentIndex(
            offset=offset,
            length=stream.tell() - offset,
            create_time=0,
            log_time=0,
            data_size=size,
            name=name,
            media_type=media_type,
        )
    )
