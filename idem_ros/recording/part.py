"""What every file of a recording gives, whatever its format: channels, counts, raw messages."""

import heapq
import io
from typing import NamedTuple

NEVER = 2**63 - 1  # [ns], the beginning of what has no message
ENCODINGS = 'cdr', 'ros1'
MAX_CHUNK = 2**30
"""What a chunk may inflate to, where nobody says otherwise [bytes]."""
LOSSES = {
    'files_missing': 'files that metadata.yaml names and that are not there',
    'files_unreadable': 'files of which nothing could be read',
    'files_damaged': 'files that are cut off or damaged, and were read as far as that goes',
    'files_extra': 'files beside them that metadata.yaml does not name',
    'chunks_left_out': 'chunks that are damaged or too large',
    'messages_left_out': 'messages of the topics asked for that should be there and were not read',
}
"""What of a recording may be lost, as `Recording.lost` counts it."""


class Channel(NamedTuple):
    """What a file says of the messages of a topic."""

    topic: str
    msgtype: str
    """As ROS 2 has it, such as 'sensor_msgs/msg/PointCloud2'."""
    encoding: str
    """Of its messages: one of `ENCODINGS`, or something that is not read."""
    form: str
    """Of the definition, see `definitions.parse`; empty: there is none."""
    definition: str

    @property
    def is_ros(self):
        """Whether messages of it can be read at all."""
        return self.encoding in ENCODINGS

    @property
    def kind(self):
        """Its type, with the encoding where that is none of ROS."""
        if self.is_ros:
            return self.msgtype
        return f'{self.msgtype or "no type"} ({self.encoding or "no encoding"})'


class Logged(NamedTuple):
    """A message as it lies in a file."""

    log_time: int
    """[ns]"""
    channel: Channel
    raw: bytes


class Block(NamedTuple):
    """A piece of a file that is read as a whole, with the span of its log times [ns]."""

    begin: int
    end: int
    offset: int
    channels: frozenset | None
    """Of which it has messages; None: of any."""


class ClippedFile(io.BufferedReader):
    """A file that is asked for no more than it holds, whatever a length in it says."""

    def __init__(self, path):
        super().__init__(io.FileIO(path))
        self.size = path.stat().st_size

    def read(self, size=-1):
        """Return at most what is left of it."""
        left = max(self.size - self.tell(), 0)
        return super().read(left if size is None or size < 0 else min(size, left))


def in_log_order(blocks, read):
    """Yield the `Logged` of blocks by log time, each block read when its time has come.

    Args:
        blocks: [`Block`]
        read: returns the list of `Logged` of a block.
    """
    queue = [(block.begin, 0, i, 0, block) for i, block in enumerate(blocks)]
    heapq.heapify(queue)
    while queue:
        *_, i, _, each = heapq.heappop(queue)
        if isinstance(each, Block):
            for k, logged in enumerate(read(each)):
                heapq.heappush(queue, (logged.log_time, 1, i, k, logged))
        else:
            yield each
