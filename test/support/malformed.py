"""PointCloud2 messages that drivers should not send: a good one with some of it spoilt."""

from types import SimpleNamespace

import numpy as np
from hypothesis import strategies as st

from idem_ros.core.geometry.se3 import exp, inverse, transform_points
from idem_ros.messages.pointcloud2 import pack_points

SECOND = 10**9
NOW = 1_700_000_000 * SECOND
END_OF_TIME = (2**31 - 1, 2**32 - 1)  # [s], [ns]: the most that the message holds
LARGEST = 2**32 - 1
T_TRUTH = exp(np.array([0.0, 0.0, 0.02, 0.05, -0.03, 0.02]))


def corner(count=150):
    """Return (target, source): a corner of three planes, and the same seen from T_TRUTH."""
    rng = np.random.default_rng(0)
    planes = rng.uniform(0, 2, (3, count, 3)).astype(np.float64)
    for axis in range(3):
        planes[axis, :, axis] = 0.0
    target = planes.reshape(-1, 3) + 1.0 + rng.normal(0, 0.002, (3 * count, 3))
    return target, transform_points(inverse(T_TRUTH), target)


TARGET, SOURCE = corner()


def stamped(seconds, nanoseconds, frame_id):
    stamp = SimpleNamespace(sec=seconds, nanosec=nanoseconds)
    return SimpleNamespace(stamp=stamp, frame_id=frame_id)


def header_at(stamp, frame_id):
    return stamped(*divmod(stamp, SECOND), frame_id)


def cloud(points, stamp, frame_id, dtype=np.float32):
    """Return a good message."""
    packed = pack_points(points, dtype)
    names = ('name', 'offset', 'datatype', 'count')
    fields = [SimpleNamespace(**dict(zip(names, each, strict=True))) for each in packed.fields]
    header = header_at(stamp, frame_id)
    return SimpleNamespace(**{**vars(packed), 'fields': fields, 'header': header})


def transform(matrix, stamp, frame_id='map', child_frame_id='lidar'):
    """Return a guess: a transform without rotation."""
    x, y, z = map(float, matrix[:3, 3])
    moved = SimpleNamespace(
        translation=SimpleNamespace(x=x, y=y, z=z),
        rotation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
    )
    header = header_at(stamp, frame_id)
    return SimpleNamespace(header=header, child_frame_id=child_frame_id, transform=moved)


def sizes(lowest):
    """Sizes near what is right, and far from it; negative ones where a message can hold them."""
    far = [2**15, 2**16 + 1, 2**24, 2**31 - 1, 2**31, LARGEST]
    if lowest < 0:
        far += [-(2**31), 2**40, 2**63 - 1, 2**64]
    return st.one_of(st.integers(lowest, 2000), st.sampled_from(far))


def values(kind):
    """Bytes of points that are no measurement."""
    return st.sampled_from(
        [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-40, 1e9, -1e18, 3e38, 1.0]
        + ([1e300, -1.7e308, 5e-324] if kind is np.float64 else [])
    )


frames = st.one_of(
    st.sampled_from(['', '/', 'map', '/map', 'lidar', 'map ', 'a/b', 'x' * 5000, 'é' * 50]),
    st.text(max_size=20),
)
moments = st.one_of(
    st.sampled_from([(0, 0), (0, 1), END_OF_TIME, (-(2**31), 0), (-1, SECOND), (2**31 - 1, 0)]),
    st.tuples(st.integers(1_699_999_990, 1_700_000_010), st.integers(0, LARGEST)),
)


@st.composite
def spoilt(draw, lowest=-5):
    """A message with one to four faults; `lowest`: of sizes, 0 where the message has no sign."""
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    message = cloud(draw(st.sampled_from([TARGET, SOURCE]))[::10], NOW, 'lidar', dtype)
    for fault in draw(st.lists(st.sampled_from(FAULTS), min_size=1, max_size=4)):
        fault(draw, message, lowest, dtype)
    return message


def _size(draw, message, lowest, dtype):
    name = draw(st.sampled_from(['height', 'width', 'point_step', 'row_step']))
    setattr(message, name, draw(sizes(lowest)))


def _consistent_sizes(draw, message, lowest, dtype):
    """Make all sizes agree with each other, and not with the fields."""
    height, width = draw(st.integers(0, 40)), draw(st.integers(0, 40))
    step = draw(st.integers(0, 40))
    message.height, message.width, message.point_step = height, width, step
    message.row_step = width * step
    message.data = np.frombuffer(
        draw(st.binary(min_size=4, max_size=64)).ljust(height * width * step, b'\xc3')[
            : height * width * step
        ],
        np.uint8,
    )


def _field(draw, message, lowest, dtype):
    if not message.fields:
        return
    field = draw(st.sampled_from(message.fields))
    name = draw(st.sampled_from(['name', 'offset', 'datatype', 'count']))
    byte = st.integers(0, 255)  # of type uint8
    words = st.sampled_from(['', 'x', 'y', 'X', 'intensity', 'x ' * 500])
    value = {'name': words, 'datatype': byte}.get(name, sizes(lowest))
    setattr(field, name, draw(value))


def _fields(draw, message, lowest, dtype):
    message.fields = draw(st.sampled_from([[], message.fields[:2], message.fields * 2]))


def _bytes(draw, message, lowest, dtype):
    keep = draw(st.integers(0, len(message.data)))
    message.data = np.concatenate(
        [message.data[:keep], np.frombuffer(draw(st.binary(max_size=40)), np.uint8)]
    )


def _content(draw, message, lowest, dtype):
    count = draw(st.sampled_from([1, 4, 5, 45, 3000]))
    chosen = draw(st.lists(values(dtype), min_size=1, max_size=3))
    header = message.header
    replaced = cloud(np.resize(chosen, (count, 3)).astype(dtype), NOW, 'lidar', dtype)
    vars(message).update(vars(replaced), header=header)


def _order(draw, message, lowest, dtype):
    message.is_bigendian = not message.is_bigendian


def _header(draw, message, lowest, dtype):
    message.header = stamped(*draw(moments), draw(frames))


FAULTS = [_size, _consistent_sizes, _field, _fields, _bytes, _content, _order, _header]
