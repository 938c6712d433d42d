"""Which target, source and guess belong together: one rule for the live node and for replay."""

from collections import deque
from typing import Any

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.stamps import DISORDER, NotYet, StampOrder
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.guess_sources import guesses_of, rates_near
from idem_ros.pairing.guesses import FOLLOWING, GuessConfig
from idem_ros.pairing.map_target import MapConfig, MapTarget
from idem_ros.pairing.pair import Pair, Refusal, comes, named, require_frames
from idem_ros.pairing.stamped_poses import StampedPoses
from idem_ros.pairing.sweep_ends import SweepEnds
from idem_ros.pairing.targets import PairingConfig, Targets

SOURCES_KEPT = 8


class Pairing:
    """Collects messages as they come and gives back the pairs that each one completes.

    `PairingConfig` says which target a source gets, `GuessConfig` which guess; a source waits
    until both are settled. Where a clock is set back, as by a recording in a loop, what is later
    is forgotten: sources and guesses, and targets but for a map.

    Args:
        config, guess_config, map_config: `PairingConfig` and so on; None: its defaults.

    Attributes:
        dropped: sources that fell out of the buffer before they were complete, or that the clock
            was set back behind. Targets and guesses that fall out have been superseded.
        refused: sources that have no usable guess or target, or frames that contradict it.
        refused_targets: targets that cannot be used, or contradict the frames of the guess.
        sweeps: `SweepEnds`, which sources wait for.
    """

    def __init__(self, config=None, guess_config=None, map_config=None):
        self.dropped = self.refused = self.refused_targets = 0
        self._config = config or PairingConfig()
        self._guess_config = guess_config or GuessConfig()
        self._guesses: Any = guesses_of(self._guess_config.type)  # whose methods are the type's
        self._map_config = map_config or MapConfig()
        self._targets = Targets(self._map_config)
        self._rates = StampedPoses()
        self.sweeps = SweepEnds()
        self._sources = deque()
        self._order = StampOrder()
        self._why = ''
        self._refusals = deque(maxlen=SOURCES_KEPT)

    @property
    def guess_type(self):
        """Where guesses come from, as `GuessConfig.type` says."""
        return self._guess_config.type

    @property
    def waiting(self):
        """How many sources wait for a target or a guess."""
        return len(self._sources)

    @property
    def jumps(self):
        """How often a clock was set back."""
        return self._order.jumps

    @property
    def last_jump(self):
        """By how much a clock was set back the last time [ns]."""
        return self._order.last_jump

    def configure(self, config, guess_config):
        """Take other parameters for the pairs to come, and try refused targets once more."""
        self._targets.forgive()
        if guess_config.type != self.guess_type:
            self._guesses = guesses_of(guess_config.type)
        self._config, self._guess_config = config, guess_config

    def add_target(self, message):
        """Keep a target cloud that can be used; return the pairs it completes."""
        return self.complete() if self._keep_target(self._targets.add, message) else []

    def has_target(self):
        """Return whether there is a target that can be used, as far as is known."""
        return bool(self._targets)

    def refuse_target(self, message, reason):
        """Count a target that came, and that cannot be used."""
        self._note_target(message, reason)

    def add_map(self, map_):
        """Keep a `MapSource` as the target in `target_frame`; return the pairs it completes."""
        self._targets.add_map(MapTarget.of(map_, self._map_config.target_frame))
        return self.complete()

    def add_source(self, message):
        """Keep a source cloud; return the pairs it completes."""
        stamp = stamp_ns(message)
        if self._order.goes_back('source', stamp):
            self._forget_after(stamp)
        self._sources.append(message)
        pairs = self.complete()
        if len(self._sources) > SOURCES_KEPT:
            self._sources.popleft()
            self.dropped += 1
        return pairs

    def add_scan(self, message):
        """Keep a cloud of a topic of sources that are targets, too: of those after them.

        Returns:
            The pairs it completes; the first scan has none, and is refused.
        """
        pairs = self.add_source(message)
        self._keep_target(self._targets.add_source, message)
        return pairs + self.complete()

    def add_guess(self, *messages):
        """Keep initial guesses, or TFMessages of /tf; return the pairs they complete."""
        for message in messages:
            for stream, stamp in self._guesses.stamps(message):
                if self._order.stays_back(stream, stamp):
                    self._forget_after(stamp)
            self._keep_guess(self._guesses.add, message)
        return self.complete()

    def add_imu(self, *messages):
        """Keep messages of an IMU for the sources to come; return no pairs."""
        for message in messages:
            if self._order.stays_back('imu', stamp_ns(message)):
                self._forget_after(stamp_ns(message))
            self._rates.add(message)
        return []

    def reset(self):
        """Begin anew where guesses follow the last result; return whether they do."""
        if self.guess_type not in FOLLOWING:
            return False
        self._guesses.reset()
        return True

    def add_static_transforms(self, *messages):
        """Keep TFMessages of /tf_static; return the pairs they complete."""
        for message in messages:
            self._keep_guess(self._guesses.add_static, message)
        return self.complete()

    def without_target(self, pair, error):
        """Return the pair of the same source with another target: its own turned out unusable.

        Args:
            pair: of this pairing.
            error: `UnusableTarget`, why.

        Raises:
            UnusableTarget: the same, where there is no other; if something came of it all the
                same, it may come again.
        """
        is_news = self._targets.refuse(pair.target, str(error))
        try:
            instead = self._pair_of(pair.source)
        except IdemError:
            if error.refinement is not None:
                self._targets.forgive(pair.target)
            raise error from None
        finally:
            if is_news:
                self._note_target(pair.target, str(error))
        return instead

    def drop_sources(self):
        """Forget the sources that wait, and count them as dropped."""
        self.dropped += len(self._sources)
        self._sources.clear()

    def forget(self):
        """Begin anew, but for the counts: drop sources, forget targets, guesses and clocks."""
        self.drop_sources()
        self._targets = Targets(self._map_config)
        self._guesses = guesses_of(self.guess_type)
        self._rates = StampedPoses()
        self._order.forget()
        self._why = ''

    def clock_goes_back(self, now):
        """Forget what is later than the node's clock, which was set back to `now` [ns]."""
        if self._order.clock_goes_back(now):
            self._forget_after(now)

    def take_refusals(self):
        """Return the refusals since the last call (at most the newest few), and forget them."""
        refusals = list(self._refusals)
        self._refusals.clear()
        return refusals

    def waiting_for(self):
        """Name what the next pair lacks: 'target', 'source', 'initial_guess', joined by 'and'."""
        sources = self._sources
        has_target, has_guess = bool(self._targets), bool(self._guesses)
        if sources and has_target:
            has_target = any(comes(self._targets_of, source) for source in sources)
        if sources and has_guess:
            has_guess = any(
                comes(self._guess_of, source, self._likely_target(source)) for source in sources
            )
        have = {'target': has_target, 'source': bool(sources), 'initial_guess': has_guess}
        return ' and '.join(name for name, is_there in have.items() if not is_there)

    def why_it_waits(self):
        """Say why the newest of the waiting sources waits; empty where none does."""
        return self._why

    def complete(self):
        """Return the pairs that can be made of what has come."""
        pairs, waiting, self._why = [], deque(), ''
        newest = self._sources[-1] if self._sources else None
        for source in self._sources:
            try:
                pairs.append(self._pair_of(source))
            except NotYet as missing:
                if missing.is_doubtful and source is not newest:
                    self._refuse(source, missing)
                    continue
                waiting.append(source)
                self._why = str(missing)
            except IdemError as error:
                self._refuse(source, error)
        self._sources = waiting
        return pairs

    def _pair_of(self, source):
        targets = named('target', self._targets_of, source)
        errors = []
        for target in targets:
            try:
                pair = self._pair_with(target, source)
            except NotYet as missing:
                if not missing.is_doubtful:
                    raise
                errors.append(missing)
            except IdemError as error:
                errors.append(error)
            else:
                for passed, error in zip(targets, errors, strict=False):
                    if self._targets.pass_over(passed):
                        self._note_target(passed, f'target: it is passed over: {error}')
                return pair
        raise errors[0]

    def _pair_with(self, target, source):
        guess = named('initial guess', self._guess_of, source, target)
        require_frames(guess, target, source)
        named('initial guess', self.sweeps.require, source, guess, self._sources)
        rates = rates_near(source, self._rates, self._guesses, self._guess_config)
        return Pair(target, source, guess, self.jumps, rates)

    def _targets_of(self, source):
        return self._targets.of_source(source, self._config)

    def _likely_target(self, source):
        try:
            return self._targets_of(source)[0]
        except IdemError:
            return None

    def _guess_of(self, source, target):
        frames = target.header.frame_id if target else '', source.header.frame_id
        return self._guesses.guess_for(stamp_ns(source), *frames, self._guess_config)

    def _refuse(self, source, error):
        self.refused += 1
        self._refusals.append(Refusal(stamp_ns(source), str(error)))

    def _keep_target(self, keep, message):
        try:
            keep(message)
        except IdemError as error:
            self._note_target(message, f'target: {error}')
            return False
        return True

    def _keep_guess(self, keep, message):
        try:
            keep(message)
        except IdemError as error:
            self._refusals.append(Refusal(0, f'initial guess: {error}', 'initial_guess'))

    def _note_target(self, message, reason):
        self.refused_targets += 1
        self._refusals.append(Refusal(stamp_ns(message), reason, 'target'))

    def _forget_after(self, stamp):
        stamp += DISORDER  # up to there it may be of the new pass, or out of order
        self._guesses.forget_after(stamp)
        self._rates.forget_after(stamp)
        self._targets.forget_after(stamp, self._config)
        kept = [source for source in self._sources if stamp_ns(source) <= stamp]
        self.dropped += len(self._sources) - len(kept)
        self._sources = deque(kept)
