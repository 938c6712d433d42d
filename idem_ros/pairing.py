"""Which target, source and guess belong together: one rule for the live node and for replay."""

from collections import deque
from dataclasses import dataclass
from typing import Any

from idem_ros.transform_message import stamp_ns

CLOUDS_KEPT = 8
GUESSES_KEPT = 256


@dataclass(frozen=True)
class Pair:
    """A source cloud with the target and the guess it is registered from, as they came."""

    target: Any
    source: Any
    guess: Any

    @property
    def stamp(self):
        """The source's stamp [ns]."""
        return stamp_ns(self.source)


@dataclass(frozen=True)
class Refusal:
    """A source that no pair was made of, and why."""

    stamp: int
    reason: str


class Pairing:
    """Collects messages as they come and gives back the pairs that each one completes.

    Target: the newest whose stamp is not after the source's, else the last received.
    Guess: the one with the source's own stamp; else, once a later one has come, the nearest in
    time. A guess with stamp 0 is timeless and serves every source until another guess comes.

    Attributes:
        dropped: sources that fell out of the buffer before they were complete. Targets and
            guesses that fall out have been superseded; what that costs shows here.
        refused: sources whose frames contradict their guess.
    """

    def __init__(self):
        self.dropped = 0
        self.refused = 0
        self._targets = deque(maxlen=CLOUDS_KEPT)
        self._sources = deque()
        self._guesses = {}
        self._timeless = None
        self._last_source_stamp = 0
        self._refusals = deque(maxlen=CLOUDS_KEPT)

    @property
    def waiting(self):
        """How many sources wait for a target or a guess."""
        return len(self._sources)

    def add_target(self, message):
        """Keep a target cloud; return the pairs it completes."""
        self._targets.append(message)
        return self._complete()

    def add_source(self, message):
        """Keep a source cloud; return the pairs it completes."""
        stamp = stamp_ns(message)
        if stamp < self._last_source_stamp:
            self._forget_guesses_after(stamp)
        self._last_source_stamp = stamp
        self._sources.append(message)
        pairs = self._complete()
        if len(self._sources) > CLOUDS_KEPT:
            self._sources.popleft()
            self.dropped += 1
        return pairs

    def add_guess(self, message):
        """Keep an initial guess; return the pairs it completes."""
        stamp = stamp_ns(message)
        self._timeless = None if stamp else message
        if stamp:
            self._forget_guesses_after(stamp)
            self._guesses[stamp] = message
            if len(self._guesses) > GUESSES_KEPT:
                del self._guesses[next(iter(self._guesses))]
        return self._complete()

    def take_refusals(self):
        """Return the refusals since the last call (at most the newest few), and forget them."""
        refusals = list(self._refusals)
        self._refusals.clear()
        return refusals

    def waiting_for(self):
        """Name what the next pair lacks: 'target', 'source', 'initial_guess', joined by 'and'."""
        guesses = [self._guess_for(stamp_ns(source)) for source in self._sources]
        missing = {
            'target': not self._targets,
            'source': not self._sources,
            'initial_guess': not (any(guesses) if guesses else self._guesses or self._timeless),
        }
        return ' and '.join(name for name, is_missing in missing.items() if is_missing)

    def _complete(self):
        if not self._targets:
            return []
        pairs, waiting = [], deque()
        for source in self._sources:
            guess = self._guess_for(stamp_ns(source))
            if guess is None:
                waiting.append(source)
                continue
            pair = Pair(self._target_for(stamp_ns(source)), source, guess)
            reason = frame_contradiction(
                'guess', guess, pair.target.header.frame_id, source.header.frame_id
            )
            if reason:
                self.refused += 1
                self._refusals.append(Refusal(pair.stamp, reason))
            else:
                pairs.append(pair)
        self._sources = waiting
        return pairs

    def _target_for(self, stamp):
        earlier = [target for target in self._targets if stamp_ns(target) <= stamp]
        # of equal stamps the one received last: max() keeps the first it meets
        return max(reversed(earlier), key=stamp_ns) if earlier else self._targets[-1]

    def _guess_for(self, stamp):
        if stamp in self._guesses:
            return self._guesses[stamp]
        if self._timeless is not None:
            return self._timeless
        if any(kept > stamp for kept in self._guesses):
            return self._guesses[min(self._guesses, key=lambda kept: abs(kept - stamp))]
        return None

    def _forget_guesses_after(self, stamp):
        """Forget what an earlier pass left behind: time went back (a recording in a loop)."""
        for later in [kept for kept in self._guesses if kept > stamp]:
            del self._guesses[later]


def frame_contradiction(name, transform, target_frame, source_frame):
    """Say which frames of a transform and its clouds contradict each other.

    Args:
        name: what the message calls the transform.
        transform: a TransformStamped-like message, source in target frame.
        target_frame, source_frame: frames of the clouds; an empty one contradicts nothing.

    Returns:
        A sentence; empty where nothing contradicts.
    """
    borders = (
        ('frame_id', transform.header.frame_id, 'target', target_frame),
        ('child_frame_id', transform.child_frame_id, 'source', source_frame),
    )
    for key, of_transform, role, of_cloud in borders:
        if of_transform and of_cloud and of_transform.lstrip('/') != of_cloud.lstrip('/'):
            return (
                f'the {name} has {key} {of_transform!r}, but the {role} cloud is in frame '
                f'{of_cloud!r}; they must be the same'
            )
    return ''
