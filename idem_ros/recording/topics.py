"""Which topic of a recording plays which role, found by type and by conventional name."""

from dataclasses import dataclass

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.messages import CLOUD, TRANSFORM

MSGTYPES = {
    'target': CLOUD,
    'source': CLOUD,
    'initial_guess': TRANSFORM,
    'ground_truth': TRANSFORM,
}
OPTIONS = {
    'target': '--target-topic',
    'source': '--source-topic',
    'initial_guess': '--guess-topic',
    'ground_truth': '--truth-topic',
}


class TopicNotFound(IdemError):
    """A role that no topic of a recording plays, or that several could."""


@dataclass(frozen=True)
class Topics:
    """The topics of a recording by role; None where it has no guess or no truth."""

    target: str
    source: str
    guess: str | None
    truth: str | None


def find_topics(recording, target=None, source=None, guess=None, truth=None):
    """Find the topics to replay; what is given by name is only checked.

    Raises:
        TopicNotFound: a name that the recording lacks or that has another type, no cloud topic,
            or several topics of which nothing says which is meant.
    """
    given = {'target': target, 'source': source, 'initial_guess': guess, 'ground_truth': truth}
    found = {role: _named(recording, role, name) for role, name in given.items() if name}
    for role, msgtype in MSGTYPES.items():
        if role in found:
            continue
        if msgtype == CLOUD:
            found[role] = find_topic(recording, msgtype, role, taken=found.values())
        else:
            found[role] = _find_optional(recording, msgtype, role, taken=found.values())
    return Topics(*(found[role] for role in MSGTYPES))


def find_topic(recording, msgtype, role, given=None, taken=()):
    """Return the topic of a type that plays a role.

    It is the one given; else the only one whose name ends in the role; else the only one there.

    Args:
        recording: an open `Recording`.
        msgtype: such as 'sensor_msgs/msg/PointCloud2'.
        role: 'target', 'source', 'initial_guess' or 'ground_truth'.
        given: the name a user gave, with or without its leading slash.
        taken: topics that already play another role.

    Raises:
        TopicNotFound: there is none, or the choice is open; the message lists the candidates.
    """
    if given:
        return _named(recording, role, given)
    candidates = _candidates(recording, msgtype, role, taken)
    conventional = [name for name in candidates if name.endswith(role)]
    for names in (conventional, candidates):
        if len(names) == 1:
            return names[0]
    kind = msgtype.rpartition('/')[2]
    if not candidates:
        every = ', '.join(f'{name} ({topic.msgtype})' for name, topic in recording.topics.items())
        raise TopicNotFound(
            f'{recording.path} has no {kind} topic left for the {role}; '
            f'its topics: {every or "none"}'
        )
    raise TopicNotFound(
        f'{recording.path} has {len(candidates)} {kind} topics, and none or several of them are '
        f'named {role}: {", ".join(candidates)}; choose one with {OPTIONS[role]}'
    )


def _find_optional(recording, msgtype, role, taken):
    if not _candidates(recording, msgtype, role, taken):
        return None
    return find_topic(recording, msgtype, role, taken=taken)


def _candidates(recording, msgtype, role, taken):
    """Return the topics of a type, without those taken or named after another role."""
    others = [other for other in MSGTYPES if other != role]
    return [
        name
        for name, topic in recording.topics.items()
        if topic.msgtype == msgtype
        and name not in taken
        and not any(name.endswith(other) for other in others)
    ]


def _named(recording, role, given):
    for name, topic in recording.topics.items():
        if name.lstrip('/') != given.lstrip('/'):
            continue
        if topic.msgtype != MSGTYPES[role]:
            raise TopicNotFound(
                f'{recording.path}: topic {name} is of type {topic.msgtype}; '
                f'the {role} must be {MSGTYPES[role]}'
            )
        return name
    candidates = [
        name for name, topic in recording.topics.items() if topic.msgtype == MSGTYPES[role]
    ]
    raise TopicNotFound(
        f'{recording.path} has no topic {given!r}; '
        f'of type {MSGTYPES[role]} it has: {", ".join(candidates) or "none"}'
    )
