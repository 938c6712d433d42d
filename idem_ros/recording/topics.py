"""Which topic of a recording plays which role, found by type and by conventional name."""

from dataclasses import dataclass

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD, TRANSFORM
from idem_ros.pairing.guesses import FOLLOWING, HEARD, POSE, STREAMED, TF
from idem_ros.pairing.turn_rates import IMU

MSGTYPES = {
    'target': CLOUD,
    'source': CLOUD,
    'initial_guess': TRANSFORM,
    'ground_truth': TRANSFORM,
}
TRUTHS = (*STREAMED.values(), 'geometry_msgs/msg/PoseStamped', 'nav_msgs/msg/Path')
"""Of true poses: the transform of each source, or poses of a body in one frame."""
STATIC = '_static'
FROM_A_FILE = ''  # in place of the name of the target's topic
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
    """The topics of a recording by role; None where it has none, or none is asked for."""

    target: str | None
    source: str
    guess: str | None
    truth: str | None
    tf: tuple[str, ...] = ()
    tf_static: tuple[str, ...] = ()
    initial_pose: str | None = None
    imu: str | None = None

    @property
    def names(self):
        """All of them, each once."""
        transforms = *self.tf, *self.tf_static
        roles = self.target, self.source, self.guess, self.truth, self.initial_pose, self.imu
        return list(dict.fromkeys(name for name in (*roles, *transforms) if name))


def find_topics(
    recording,
    target=None,
    source=None,
    guess=None,
    truth=None,
    *,
    guess_type='transform',
    tf=None,
    imu=None,
):
    """Find the topics to replay; what is given by name is only checked.

    Args:
        recording: an open `Recording`.
        target, source, guess, truth: names; None: found by type and name; of the target
            `FROM_A_FILE`: there is none.
        guess_type: of `GuessConfig`; of type 'initial_pose' the guess is the topic of its poses.
            A recording may lack transforms to start from, not what else is asked for.
        tf: names of topics of transforms, where guesses come from tf; None: /tf, or the only one.
            What is static comes from the topic beside each, or from /tf_static.
        imu: name of the topic of an IMU; None: none is taken.

    Raises:
        TopicNotFound: a name that the recording lacks or that has another type, no cloud topic,
            or several topics of which nothing says which is meant.
    """
    pose = _find_pose(recording, guess_type, guess)
    guess = None if guess_type == 'initial_pose' else guess
    given = {'target': target, 'source': source, 'initial_guess': guess, 'ground_truth': truth}
    of_guess = None if guess_type == 'initial_pose' else HEARD.get(guess_type)
    of_target = None if target == FROM_A_FILE else CLOUD
    kinds = {
        'target': of_target,
        'source': CLOUD,
        'initial_guess': of_guess,
        'ground_truth': TRUTHS,
    }
    if guess and guess_type not in HEARD:
        raise TopicNotFound(
            f'{guess!r} is given for the guess, but of type {guess_type!r} it comes from no such '
            f'topic; it does of type {", ".join(HEARD)}'
        )
    found = {
        role: _named(recording, role, name, kinds[role]) for role, name in given.items() if name
    }
    for role, msgtype in kinds.items():
        if role in found:
            continue
        if msgtype is None:
            found[role] = None
        elif role == 'ground_truth' and (named := find_truth(recording, found.values())):
            found[role] = named
        elif msgtype not in (TRANSFORM, TRUTHS):
            found[role] = find_topic(recording, msgtype, role, taken=found.values())
        else:
            found[role] = _find_optional(recording, TRANSFORM, role, taken=found.values())
    if tf and guess_type != 'tf':
        raise TopicNotFound(
            f'{", ".join(tf)} is given for tf, but guesses of type {guess_type!r} come from '
            'elsewhere; from tf they come with --initial-guess-type tf'
        )
    transforms = _find_tf(recording, tf) if guess_type == 'tf' else ((), ())
    imu = imu and _named(recording, 'imu', imu, IMU)
    return Topics(*(found[role] for role in MSGTYPES), *transforms, pose, imu)


def find_topic(recording, msgtype, role, given=None, taken=()):
    """Return the topic of a type that plays a role.

    It is the one given; else the only one whose name ends in the role; else the only one there.

    Args:
        recording: an open `Recording`.
        msgtype: such as 'sensor_msgs/msg/PointCloud2', or several.
        role: 'target', 'source', 'initial_guess' or 'ground_truth'.
        given: the name a user gave, with or without its leading slash.
        taken: topics that already play another role.

    Raises:
        TopicNotFound: there is none, or the choice is open; the message lists the candidates.
    """
    if given:
        return _named(recording, role, given, msgtype)
    candidates = _candidates(recording, msgtype, role, taken)
    conventional = [name for name in candidates if name.endswith(role)]
    for names in (conventional, candidates):
        if len(names) == 1:
            return names[0]
    kind = msgtype.rpartition('/')[2] if isinstance(msgtype, str) else 'pose'
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


def find_truth(recording, taken=()):
    """Return the topic of true poses that is named so, of transforms first; None: there is none.

    Raises:
        TopicNotFound: several are.
    """
    for kinds in ((TRANSFORM,), TRUTHS):
        found = _candidates(recording, kinds, 'ground_truth', taken)
        if any(name.endswith('ground_truth') for name in found):
            return find_topic(recording, kinds, 'ground_truth', taken=taken)
    return None


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
        if topic.msgtype in _several(msgtype)
        and name not in taken
        and not any(name.endswith(other) for other in others)
    ]


def _find_pose(recording, guess_type, given):
    """Return the topic of the poses that a type of guess starts from; None: of none."""
    if guess_type not in FOLLOWING:
        return None
    if guess_type == 'initial_pose' and given:
        return _named(recording, 'initial_guess', given, POSE)
    names = [name for name, topic in recording.topics.items() if topic.msgtype == POSE]
    named = [name for name in names if name.rpartition('/')[2] == 'initialpose']
    if guess_type == 'initial_pose' and len(named) != 1:
        raise TopicNotFound(
            f'{recording.path} has {len(named) or "no"} topics named initialpose to take the '
            f'first pose from; of type {POSE} it has: {", ".join(names) or "none"}; choose one '
            'with --guess-topic'
        )
    return named[0] if named else None


def _find_tf(recording, given):
    """Return the topics of moving and of static transforms."""
    names = [name for name, topic in recording.topics.items() if topic.msgtype == TF]
    moving = [name for name in names if not name.endswith(STATIC)]
    if not names:
        raise TopicNotFound(f'{recording.path} has no topic of type {TF} to take the guess from')
    if given:
        chosen = [_named(recording, 'tf', name, TF) for name in given]
    else:
        chosen = [name for name in moving if name.lstrip('/') == 'tf'] or moving
        if len(chosen) > 1:
            raise TopicNotFound(
                f'{recording.path} has {len(moving)} topics of transforms, and none is named /tf: '
                f'{", ".join(moving)}; choose one or several with --tf-topic'
            )
    beside = tuple(name + STATIC for name in chosen if name + STATIC in names)
    return tuple(chosen), beside or static_transforms(recording)


def static_transforms(recording):
    """Return the topics of transforms that hold for all time: /tf_static, or the only one."""
    names = [name for name, topic in recording.topics.items() if topic.msgtype == TF]
    only = tuple(name for name in names if name.endswith(STATIC))
    usual = tuple(name for name in names if name.lstrip('/') == 'tf_static')
    return usual or (only if len(only) == 1 else ())


def _named(recording, role, given, msgtype):
    for name, topic in recording.topics.items():
        if name.lstrip('/') != given.lstrip('/'):
            continue
        if topic.msgtype not in _several(msgtype):
            raise TopicNotFound(
                f'{recording.path}: topic {name} is of type {topic.msgtype}; '
                f'the {role} must be {" or ".join(_several(msgtype))}'
            )
        return name
    kinds = _several(msgtype)
    candidates = [name for name, topic in recording.topics.items() if topic.msgtype in kinds]
    raise TopicNotFound(
        f'{recording.path} has no topic {given!r}; '
        f'of type {" or ".join(kinds)} it has: {", ".join(candidates) or "none"}'
    )


def _several(msgtype):
    return (msgtype,) if isinstance(msgtype, str) else msgtype
