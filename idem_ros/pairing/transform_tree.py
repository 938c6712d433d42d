"""A tree of frames from /tf and /tf_static: where one frame is in another at a stamp."""

from dataclasses import dataclass, field, replace

import numpy as np

from idem_ros.core.exceptions import IdemError, InvalidTransform
from idem_ros.core.geometry.se3 import inverse
from idem_ros.messages.stamps import NotYet
from idem_ros.messages.transform_message import matrix_of, stamp_ns
from idem_ros.pairing.guesses import WINDOW, Guess, Trail
from idem_ros.pairing.stamped_poses import DoubtfulGuess, StampedPoses, pose_at


@dataclass
class _Edge:
    """Where a frame is in its parent: for all time, or by stamps."""

    parent: str
    static: object = None
    poses: StampedPoses = field(default_factory=StampedPoses)


class TransformTree:
    """Guesses from tf: the pose of the source frame in the target frame at the source's stamp.

    Every transform on the way is taken at that stamp, by the rules of `stamped_poses.pose_at`. A
    frame that is given another parent forgets its way to the one before; one that is given itself
    as parent does not.
    """

    def __init__(self):
        self._edges = {}

    def __bool__(self):
        return bool(self._edges)

    def stamps(self, message):
        """Return (stream, stamp) of what a TFMessage holds."""
        return [(('tf', _name(t.child_frame_id)), stamp_ns(t)) for t in _edges_of(message)]

    def add(self, message):
        """Keep the transforms of a TFMessage of /tf."""
        for transform in _edges_of(message):
            edge = self._edge(transform)
            edge.static = None
            edge.poses.add(transform)

    def add_static(self, message):
        """Keep the transforms of a TFMessage of /tf_static; they hold for all time.

        Raises:
            InvalidTransform: some are none; what was known of their frames holds on.
        """
        errors = []
        for transform in _edges_of(message):
            try:
                matrix_of(transform)
            except IdemError as error:
                errors.append(f'{transform.child_frame_id!r} in /tf_static: {error}')
            else:
                self._edge(transform).static = transform
        if errors:
            raise InvalidTransform('; '.join(errors))

    def forget_after(self, stamp):
        """Forget what is later than a stamp [ns]; what is static stays."""
        for edge in self._edges.values():
            edge.poses.forget_after(stamp)

    def guess_for(self, stamp, target_frame, source_frame, config):
        """Return the `Guess`: the source frame in the target frame at a stamp [ns].

        Raises:
            NotYet: transforms are missing, or not there yet at that stamp; it names the frames.
            DoubtfulGuess, InvalidTransform: a cloud names no frame, frames go in a circle, or a
                transform will not do.
        """
        target, source = _name(target_frame), _name(source_frame)
        if not (target and source):
            role = 'source' if target else 'target'
            raise DoubtfulGuess(
                f'the {role} cloud names no frame, which tf could tell the pose of'
            )
        of_target, of_source = self._way_up(target), self._way_up(source)
        top = next((frame for frame in of_source if frame in of_target), None)
        if top is None:
            raise NotYet(self._not_connected(target, source), is_doubtful=True)
        up = of_source[: of_source.index(top)], of_target[: of_target.index(top)]
        pose = self._pose(up, stamp, config)
        return Guess(pose, target_frame, source_frame, trail=self._trail(up, stamp, config))

    def _pose(self, up, stamp, config):
        T_top_source, T_top_target = (self._pose_along(way, stamp, config) for way in up)
        return T_top_source if not up[1] else inverse(T_top_target) @ T_top_source

    def _trail(self, up, stamp, config):
        """Return the `Trail` of a frame by the transforms on both ways up, as they are now."""
        near = TransformTree()
        for frame in (*up[0], *up[1]):
            edge = self._edges[frame]
            near._edges[frame] = replace(edge, poses=edge.poses.near(stamp))
        moving = [e.poses.stamps for e in near._edges.values() if e.static is None]
        begin = max((each[0] for each in moving if each), default=stamp - WINDOW)
        end = min((each[-1] for each in moving if each), default=stamp + WINDOW)
        between = {each for stamps in moving for each in stamps if begin <= each <= end}
        stamps = tuple(sorted(between | (set() if moving else {begin, end})))
        return Trail(stamps, lambda each: near._pose(up, each, config))

    def _edge(self, transform):
        child, parent = _name(transform.child_frame_id), _name(transform.header.frame_id)
        if child not in self._edges or self._edges[child].parent != parent:
            self._edges[child] = _Edge(parent)
        return self._edges[child]

    def _way_up(self, frame):
        """Return a frame and those above it, up to the root."""
        way = [frame]
        while edge := self._edges.get(way[-1]):
            if edge.parent in way:
                circle = ' in '.join(repr(name) for name in (*way, edge.parent))
                raise DoubtfulGuess(f'tf goes in a circle: {circle}')
            way.append(edge.parent)
        return way

    def _pose_along(self, way, stamp, config):
        pose = np.eye(4)
        for frame in way:
            edge = self._edges[frame]
            try:
                pose = self._pose_of(edge, stamp, config) @ pose
            except NotYet as missing:
                raise NotYet(f'{frame!r} in {edge.parent!r}: {missing}') from missing
            except IdemError as error:
                raise type(error)(f'{frame!r} in {edge.parent!r}: {error}') from error
        return pose

    def _pose_of(self, edge, stamp, config):
        if edge.static is not None:
            return matrix_of(edge.static)
        return pose_at(stamp, edge.poses.around(stamp), config)

    def _not_connected(self, target, source):
        parents = {edge.parent for edge in self._edges.values()}
        unknown = [f for f in (source, target) if f not in self._edges and f not in parents]
        why = f' (tf knows no {" and no ".join(map(repr, unknown))})' if unknown else ''
        return (
            f'tf does not connect the source frame {source!r} with the target frame '
            f'{target!r}{why}'
        )


def _edges_of(message):
    """Return the transforms of a message but for those of a frame to itself: they say nothing."""
    return [t for t in message.transforms if _name(t.child_frame_id) != _name(t.header.frame_id)]


def _name(frame):
    return frame.lstrip('/')
