"""Messages of which only the header is read until more is asked for: of most, nobody ever does."""

import struct
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message

from idem_ros.core.exceptions import IdemError

LITTLE_ENDIAN = b'\x00\x01'  # how CDR begins
BODY = 4  # [bytes] of CDR from which on fields are aligned
HEAD, LENGTH = struct.Struct('<iII'), struct.Struct('<I')  # stamp and a length; a length
PLACES = ['header', 'child_frame_id']


class UnreadableMessage(IdemError):
    """Bytes that are no message of their type."""


class _Stamp(NamedTuple):
    sec: int
    nanosec: int


class _Header(NamedTuple):
    stamp: _Stamp
    frame_id: str


class Unread:
    """A message whose other fields are read when one of them is first asked for.

    Args:
        kind: class of the message, which begins with a header.
        content: CDR bytes of it.
        has_child: whether a child frame follows the header.

    Raises:
        UnreadableMessage: they are none; so does a field that is asked for later.
    """

    __slots__ = ('_content', '_kind', '_message', 'child_frame_id', 'header')

    def __init__(self, kind: Any, content: bytes, has_child: bool) -> None:
        self._kind, self._content, self._message = kind, content, None
        try:
            self._read_head(content, has_child)
        except (struct.error, UnicodeDecodeError):
            self.header = self._whole().header
            if has_child:
                self.child_frame_id = self._whole().child_frame_id

    def _read_head(self, content: bytes, has_child: bool) -> None:
        if content[:2] != LITTLE_ENDIAN:
            raise struct.error
        sec, nanosec, size = HEAD.unpack_from(content, BODY)
        begin = BODY + HEAD.size
        self.header = _Header(_Stamp(sec, nanosec), _string(content, begin, size))
        if has_child:
            begin += size + -size % 4
            (size,) = LENGTH.unpack_from(content, begin)
            self.child_frame_id = _string(content, begin + LENGTH.size, size)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._whole(), name)

    def _whole(self) -> Any:
        if self._message is None:
            try:
                self._message = deserialize_message(self._content, self._kind)
            except Exception as error:  # of rclpy's RMWError, which it does not export
                raise UnreadableMessage('its bytes are no message of its type') from error
        return self._message


def begins_with_header(kind: Any) -> bool:
    """Whether a class of messages can be `Unread`."""
    return [*kind.get_fields_and_field_types()][:1] == PLACES[:1]


def unread_of(kind: Any) -> Callable[[bytes], Unread]:
    """Return what makes `Unread` messages of the bytes of a class of messages."""
    has_child = [*kind.get_fields_and_field_types()][:2] == PLACES
    return lambda content: Unread(kind, content, has_child)


def _string(content: bytes, begin: int, size: int) -> str:
    """Return a string of so many bytes, of which the last is zero."""
    end = begin + size - 1
    if not size or content[end : end + 1] != b'\x00':
        raise struct.error
    return content[begin:end].decode()
