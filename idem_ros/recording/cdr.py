"""Recorded messages of ROS 1 and ROS 2 as the bytes that ROS 2 Jazzy sends."""

from rosbags.serde import SerdeError

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.messages import typestore


class NotSendable(IdemError):
    """A recorded message that ROS 2 Jazzy has no type for, or another one of the same name."""


def is_known(msgtype):
    """Return whether ROS 2 Jazzy's own packages define a message type."""
    return msgtype in typestore().types


def to_cdr(message):
    """Return a message that was read from a recording as ROS 2 CDR bytes.

    Raises:
        NotSendable: the recorded definition differs from Jazzy's.
    """
    try:
        return bytes(typestore().serialize_cdr(message, message.__msgtype__))
    except (KeyError, AttributeError, TypeError, ValueError, SerdeError) as error:
        raise NotSendable(
            f'{message.__msgtype__} was recorded with fields other than those of ROS 2 Jazzy: '
            f'{type(error).__name__}: {error}'
        ) from error
