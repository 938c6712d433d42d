"""Which target a source is registered to, by the stamps of both."""

import itertools
from dataclasses import dataclass
from typing import Any

from idem_ros.core.exceptions import IdemError, InvalidCloud
from idem_ros.core.parameter import parameter, require_fields
from idem_ros.maps.accumulated import AccumulatedMap
from idem_ros.messages.pointcloud2 import InvalidPointCloud2, read_points, require_points
from idem_ros.messages.stamps import NotYet, seconds
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.pairing.map_target import ACCUMULATE, MapConfig, MapTarget

PAIRINGS = ('latched', 'nearest', 'newest')
KEPT = 8  # of each frame
FRAMES_KEPT = 8
MOST_BYTES = 2**28  # of each frame, but for the newest two: maps are kept as they came
LEAST_POINTS = 5  # a point and its four neighbours: what has no spacing cannot be registered


class NoTarget(IdemError):
    """A source that no target is near enough to."""


class UnusableTarget(InvalidCloud):
    """A target that turns out to be unusable when it is read: another may do.

    Attributes:
        refinement: what came of it all the same, where no other does; None: nothing.
    """

    def __init__(self, reason, refinement=None):
        super().__init__(reason)
        self.refinement = refinement


@dataclass(frozen=True)
class PairingConfig:
    """Which target a source is registered to."""

    pairing: str = parameter(
        'latched',
        'target of a source: "latched" (the newest that is not after it, else the last received: '
        'a map, or the scan before), "nearest" (in time, once one of its stamp or later has '
        'come), "newest" (of those received, whatever its stamp)',
        choices=PAIRINGS,
    )
    pairing_tolerance: float = parameter(
        0.05, 'with nearest: a source is refused whose target is farther from its stamp', 's'
    )

    def __post_init__(self):
        require_fields(self)


@dataclass
class _Kept:
    """A target that was received."""

    message: Any
    refused: str = ''
    """Why it cannot be used; empty where it can, as far as is known."""
    is_told: bool = False
    """Whether somebody was told that it was passed over or refused."""

    @property
    def stamp(self):
        return stamp_ns(self.message)

    @property
    def frame(self):
        return self.message.header.frame_id.lstrip('/')

    @property
    def is_timeless(self):
        return _is_map(self.message) and not self.stamp


class Targets:
    """The targets received last, of each frame as many.

    One that cannot be used takes the place of none that can, nor does one of another frame.

    Args:
        map_config: `MapConfig`, whether each is a part of one map; None: its defaults.
    """

    def __init__(self, map_config=None):
        self._map_config = map_config or MapConfig()
        self._kept = []  # in the order they came
        self._refused = ''
        self._are_sources = False

    def __bool__(self):
        return any(not each.refused for each in self._kept)

    def add(self, message):
        """Keep a target cloud.

        Raises:
            InvalidPointCloud2: it holds too few points that can be used; it is not kept.
        """
        try:
            require_points(message, LEAST_POINTS)
        except InvalidPointCloud2 as error:
            self._refused = str(error)
            raise
        if self._map_config.target_mode == ACCUMULATE:
            message = self._grown_by(message)
        again = next((each for each in self._kept if _is_same(each.message, message)), None)
        if again is not None:
            self._drop([again])  # to be the last received: what is prepared of it is kept
        self._kept.append(again or _Kept(message))
        self._make_room(self._kept[-1].frame)

    def add_map(self, target):
        """Keep a `MapTarget`; it takes the place of the one of its frame."""
        frame = target.header.frame_id.lstrip('/')
        self._drop([each for each in self._of_frame(frame) if _is_map(each.message)])
        self._kept.append(_Kept(target))

    def add_source(self, message):
        """Keep a source that is a target to those after it, see `add`; a map there is none."""
        self._are_sources = True
        self.add(message)

    def refuse(self, message, reason):
        """Use a target no more, until `forgive`; return whether that is news."""
        return self._mark(message, lambda each: setattr(each, 'refused', reason))

    def pass_over(self, message):
        """Note that another target was taken instead; return whether that is news."""
        return self._mark(message, lambda each: None)

    def forgive(self, message=None):
        """Use one again that was refused, or all: with other parameters they may be of use."""
        for each in self._kept:
            if message is None or each.message is message:
                each.refused = ''

    def forget_after(self, stamp, config):
        """Forget what is later than a stamp [ns], but for a map, which need not come again."""
        earlier = [each for each in self._kept if each.stamp <= stamp]
        is_map = config.pairing != 'nearest' and not self._are_sources
        self._kept = earlier or (self._kept[-1:] if is_map else [])

    def of_source(self, source, config):
        """Return the targets that a source may be registered to: the best of each frame.

        The best of all comes first; of targets with the same stamp it is the one received last.
        A cloud is never its own target, nor is one that came after it where it is among them.

        Raises:
            NotYet: they may still come.
            NoTarget: none is near enough.
        """
        stamp = stamp_ns(source)
        before = list(
            itertools.takewhile(lambda each: not _is_same(each.message, source), self._kept)
        )
        is_target = len(before) < len(self._kept)
        usable = [each for each in reversed(before) if not each.refused]
        if is_target or self._are_sources:
            usable = [each for each in usable if each.stamp <= stamp]
        if not usable and is_target:
            raise NoTarget(
                'the only one is the source itself, which is never its own target; '
                'none came before it'
            )
        if not usable:
            raise NotYet(self._why_none())
        return _first_of_each_frame(_in_order(usable, stamp, config, is_target))

    def _mark(self, message, change):
        for each in self._kept:
            if each.message is message:
                is_news, each.is_told = not each.is_told, True
                change(each)
                return is_news
        return False

    def _grown_by(self, part):
        """Return the `MapTarget` of all parts of a frame so far; that before is let go of."""
        frame = part.header.frame_id.lstrip('/')
        before = [each for each in self._of_frame(frame) if _is_map(each.message)]
        config = self._map_config
        grown = AccumulatedMap(
            lambda: read_points(part).points,
            before[-1].message.map if before else None,
            config.target_radius,
            config.target_voxel_size,
        )
        self._drop(before)
        return MapTarget(part.header, grown)

    def _of_frame(self, frame):
        return [each for each in self._kept if each.frame == frame]

    def _make_room(self, frame):
        of_frame = self._of_frame(frame)
        sizes = [len(_bytes_of(each.message) or b'') for each in of_frame]
        if len(of_frame) > KEPT or (len(of_frame) > 2 and sum(sizes) > MOST_BYTES):
            refused = [each for each in of_frame if each.refused]
            self._drop([(refused or of_frame)[0]])
        newest_first = list(dict.fromkeys(each.frame for each in reversed(self._kept)))
        for old in newest_first[FRAMES_KEPT:]:
            self._drop([each for each in self._kept if each.frame == old])

    def _drop(self, those):
        self._kept = [each for each in self._kept if not any(each is other for other in those)]

    def _why_none(self):
        refused = next((each.refused for each in reversed(self._kept) if each.refused), '')
        why = refused or self._refused
        return f'none that can be used has come; the last: {why}' if why else 'none has come'


def _in_order(usable, stamp, config, is_target):
    """Return targets, given newest received first, from the best to the worst."""
    if timeless := [each for each in usable if each.is_timeless]:
        return timeless  # a map from a file is the only target there is
    if config.pairing == 'nearest':
        return _nearest(usable, stamp, config.pairing_tolerance, is_target)
    newest = sorted(usable, key=lambda each: -each.stamp)  # sorts are stable
    if config.pairing == 'newest':
        return newest
    earlier = [each for each in newest if each.stamp <= stamp]
    return earlier + [each for each in usable if each.stamp > stamp]


def _nearest(usable, stamp, tolerance, is_target):
    newest = max(each.stamp for each in usable)
    if newest < stamp and not is_target:
        raise NotYet(f'the newest is {seconds(stamp - newest)} older than the source')
    ranked = sorted(usable, key=lambda each: abs(each.stamp - stamp))
    off = abs(ranked[0].stamp - stamp)
    if off > tolerance * 1e9:
        raise NoTarget(
            f'the nearest target is {seconds(off)} off the source; '
            f'pairing_tolerance is {tolerance:g} s'
        )
    return [each for each in ranked if abs(each.stamp - stamp) <= tolerance * 1e9]


def _first_of_each_frame(ranked):
    best = {}
    for each in ranked:
        best.setdefault(each.frame, each.message)
    return list(best.values())


def _is_same(target, source):
    """Return whether two messages are one cloud, be it sent on by somebody under another topic."""
    if target is source:
        return True
    if _is_map(target) or _is_map(source):
        return False
    return (
        stamp_ns(target) == stamp_ns(source)
        and target.header.frame_id == source.header.frame_id
        and (target.height, target.width) == (source.height, source.width)
        and _bytes_of(target) == _bytes_of(source)
    )


def _is_map(message):
    return isinstance(message, MapTarget)


def _bytes_of(message):
    if _is_map(message):
        return None
    try:
        return memoryview(message.data)  # compared without a copy, up to the first difference
    except TypeError:
        return None
