"""Recordings in every format, spoilt: bytes, definitions, chunks, messages, text of metadata."""

import random
import shutil
from pathlib import Path

import mcap.writer
import numpy as np
from mcap.writer import CompressionType
from recordings import scans, write_rosbag1, write_sqlite3
from rosbags.rosbag1 import Writer
from values import EXTREMES, chance, spoilt_bytes

from idem_ros.recording.messages import typestore
from idem_ros.recording.writer import write_mcap

WORDS = [
    b'float64',
    b'string',
    b'uint8[]',
    b'uint8[4,4]',
    b'string[1000000]',
    b'std_msgs/Header',
    b'std_msgs/msg/Header',
    b'sequence<uint8, 99999999>',
    b'(((1)))',
    b'wstring',
    b'geometry_msgs/Transform',
    b'\x1b[31m',
    b'MSG: ',
    b'=' * 80,
    b'\n',
    b'int64[2147483647]',
    b'time',
    b'duration',
    b'bool',
    b'x\x00y',
    b'module a { };',
    b'string<=3',
    b'#' * 500,
]


class Recordings:
    """Cases of spoilt recordings, replayed.

    Args:
        inputs: a folder, into which they are written whole.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        messages = list(scans(np.random.default_rng(0), 3, points=150))
        self._messages = [
            (
                topic,
                time,
                each.__msgtype__,
                bytes(typestore().serialize_cdr(each, each.__msgtype__)),
            )
            for topic, time, each in messages
        ]
        write_mcap(inputs / 'whole.mcap', messages)
        write_rosbag1(inputs / 'whole.bag', messages)
        write_rosbag1(inputs / 'packed.bag', messages, Writer.CompressionFormat.BZ2, chunk=4096)
        write_sqlite3(inputs / 'whole', messages)
        self._folder = inputs / 'whole'
        files = [*inputs.glob('*.bag'), inputs / 'whole.mcap', *self._folder.glob('*.db3')]
        self._files = {
            path.suffix: path.read_bytes() for path in files if 'packed' not in path.name
        }
        self._files['.packed.bag'] = (inputs / 'packed.bag').read_bytes()

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        how = rng.random()
        if how < 0.45:
            suffix = chance(rng, *self._files)
            name = f'spoilt{suffix}'
            Path(name).write_bytes(spoilt_bytes(rng, self._files[suffix]))
        elif how < 0.9:
            name = 'spoilt.mcap'
            self._write_mcap(rng, name)
        else:
            name = 'spoilt'
            shutil.copytree(self._folder, name)
            path = chance(rng, *sorted(Path(name).iterdir()))
            path.write_bytes(spoilt_bytes(rng, path.read_bytes()))
        return ['replay', name, '--voxel-size', '0.2']

    def _write_mcap(self, rng, name):
        """Write an MCAP that is well made, of messages, definitions and times that are not."""
        packed = chance(rng, CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4)
        with Path(name).open('wb') as stream:
            writer = mcap.writer.Writer(
                stream, chunk_size=chance(rng, 200, 10**5), compression=packed
            )
            writer.start(profile=chance(rng, 'ros2', 'ros2', '', 'ros1'))
            channels = {}
            for topic, time, msgtype, content in self._messages:
                if topic not in channels or rng.random() < 0.02:
                    channels[topic] = _channel(rng, writer, topic, msgtype)
                if rng.random() < 0.3:
                    content = spoilt_cdr(rng, content)
                if rng.random() < 0.05:
                    time = chance(rng, *EXTREMES)
                writer.add_message(channels[topic], time, content, time)
            if rng.random() < 0.9:
                writer.finish()
        if rng.random() < 0.2:
            Path(name).write_bytes(spoilt_bytes(rng, Path(name).read_bytes()))


def spoilt_cdr(rng, content):
    """Return a message whose sizes, numbers or end are others."""
    if rng.random() < 0.4:  # of a cloud: the sizes, which come before the points
        at = rng.randrange(4, min(len(content), 160), 4)
        size = chance(rng, *EXTREMES) % 2**32
        return content[:at] + size.to_bytes(4, 'little') + content[at + 4 :]
    if rng.random() < 0.3:  # random points, all in one
        return content[:160] + random.Random(rng.random()).randbytes(max(len(content) - 160, 0))
    return spoilt_bytes(rng, content)


def _channel(rng, writer, topic, msgtype):
    definition, _ = typestore().generate_msgdef(msgtype, ros_version=2)
    text = definition.encode()
    if rng.random() < 0.4:
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(text) + 1)
            text = text[:at] + chance(rng, *WORDS) + text[at + chance(rng, 0, 5, 30) :]
    name = (
        msgtype
        if rng.random() < 0.9
        else chance(rng, '', 'a/msg/B', 'std_msgs/msg/String', '\x1b')
    )
    encoding = chance(rng, *['ros2msg'] * 8, 'ros2idl', '')
    schema = writer.register_schema(name, encoding, text)
    shown = topic if rng.random() < 0.95 else chance(rng, '', '\x1b[2J', topic * 300, '/source')
    coding = chance(rng, *['cdr'] * 12, 'ros1', 'json', '')
    return writer.register_channel(shown, coding, schema)
