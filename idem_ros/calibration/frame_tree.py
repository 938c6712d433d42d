"""Frames that do not move against each other: where each is in its parent, and in any other."""

import numpy as np

from idem_ros.core.exceptions import IdemError
from idem_ros.core.geometry.se3 import checked_transform, inverse

SHOWN = 12  # frames in a message


class UnknownStart(IdemError):
    """Frames of which nothing says where a sensor is to be looked for."""


class FrameTree:
    """Frames and their parents.

    Args:
        source: what it was read from, for messages.
        edges: {child: (parent, (4, 4) child in parent)}; slashes at the begin are left out.
        covariances: {child: (6, 6) x y z rx ry rz of it, in the axes of its parent}, where known.

    Raises:
        InvalidTransform: one is no rigid transform.
    """

    def __init__(self, source, edges, covariances=None):
        self.source = source
        self.covariances = {bare(child): C for child, C in (covariances or {}).items()}
        self._edges = {
            bare(child): (bare(parent), checked_transform(T, f'{source}: {child} in {parent}'))
            for child, (parent, T) in edges.items()
        }

    @property
    def frames(self):
        """All frames, in the order of their names."""
        return sorted({*self._edges, *(parent for parent, _ in self._edges.values())})

    def parent_of(self, frame):
        """Return the parent of a frame; None: it has none."""
        return self._edges.get(bare(frame), (None, None))[0]

    def pose(self, target, source):
        """Return the (4, 4) pose of one frame in another.

        Raises:
            UnknownStart: one is not known, or nothing connects them; it says what is known.
        """
        target, source = bare(target), bare(source)
        for frame in (target, source):
            if frame not in self.frames:
                known = ', '.join(self.frames[:SHOWN]) or 'none'
                raise UnknownStart(
                    f'{self.source} says nothing of the frame {frame!r}; its frames: {known}'
                )
        of_target, of_source = self._ways_up(target), self._ways_up(source)
        top = next((frame for frame in of_source if frame in of_target), None)
        if top is None:
            raise UnknownStart(f'{self.source} does not connect {source!r} with {target!r}')
        return inverse(of_target[top]) @ of_source[top]

    def _ways_up(self, frame):
        """Return {ancestor: (4, 4) frame in it}, from the frame itself to the root."""
        found, pose = {frame: np.eye(4)}, np.eye(4)
        while frame in self._edges:
            frame, T = self._edges[frame]
            if frame in found:
                raise UnknownStart(f'{self.source}: frames go in a circle at {frame!r}')
            pose = T @ pose
            found[frame] = pose
        return found

    def with_poses(self, names, poses):
        """Return {frame: (parent, (4, 4) in it)} of sensors that are elsewhere now.

        Each stays below the parent that it has; one without a parent is below the first, unless
        the first is below it. What is between the first and the root stays.

        Args:
            names: of the sensors; the first is the reference.
            poses: (4, 4) of each in the frame of the first.
        """
        moved = dict(zip(map(bare, names), poses, strict=True))
        first = bare(names[0])
        above = self._ways_up(first)
        return {
            name: self._in_its_parent(bare(name), first, moved)
            for name in names
            if self.parent_of(name) is not None or bare(name) not in above
        }

    def _in_its_parent(self, name, first, moved):
        parent = self.parent_of(name)
        if parent is None:
            return first, moved[name]
        anchor = next((frame for frame in self._ways_up(parent) if frame in moved), first)
        return parent, inverse(moved[anchor] @ self.pose(anchor, parent)) @ moved[name]


def bare(frame):
    """Return the name of a frame without the slash that tf once had before it."""
    return str(frame).lstrip('/')
