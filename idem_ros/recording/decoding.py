"""Raw messages of a recording as messages, by the standard's types only."""

from functools import cache

from rosbags.typesys import Stores, get_typestore

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.definitions import difference, parse
from idem_ros.recording.inflating import inflated_message
from idem_ros.recording.messages import typestore


class UnreadableTopic(IdemError):
    """A topic whose messages cannot be read: of another encoding, type or definition."""


@cache
def _ros1():
    return get_typestore(Stores.ROS1_NOETIC)


STANDARDS = {'cdr': (typestore, 'ROS 2 Jazzy'), 'ros1': (_ros1, 'ROS 1 Noetic')}


def decoder(channel, max_chunk):
    """Return what makes a message of the bytes of one.

    Args:
        channel: `Channel`.
        max_chunk: what a message compressed by itself may inflate to [bytes].

    Raises:
        UnreadableTopic: what its definition says lies otherwise in the bytes than what the
            standard's does, or the standard has no such type.
    """
    if not channel.is_ros:
        raise UnreadableTopic(
            f'{channel.topic} is of type {channel.kind}; messages of ROS are cdr or ros1'
        )
    get_store, standard = STANDARDS[channel.encoding]
    store, msgtype = get_store(), channel.msgtype
    if msgtype not in store.types:
        raise UnreadableTopic(f'{channel.topic} is of type {msgtype}, which {standard} lacks')
    if channel.definition.strip():
        _require_same(channel, store, standard)
    if channel.encoding == 'ros1':
        return lambda raw: store.deserialize_ros1(raw, msgtype)
    return lambda raw: store.deserialize_cdr(inflated_message(raw, max_chunk), msgtype)


def _require_same(channel, store, standard):
    try:
        recorded = parse(channel.form, channel.definition, channel.msgtype)
        reason = difference(channel.msgtype, store, recorded)
    except IdemError as error:
        reason = str(error)
    if reason:
        raise UnreadableTopic(
            f'{channel.topic} was recorded with another {channel.msgtype} than that of '
            f'{standard}: {reason}'
        )
