"""Recordings of whatever bytes are read, or refused in one line; IDEM_FUZZ says how many."""

import os
from itertools import pairwise

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from recordings import bare_mcap, ros1_bag, scans, write_rosbag1, write_sqlite3
from rosbags.rosbag1 import Writer as Writer1

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD
from idem_ros.recording.definitions import difference, parse
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import open_recording

TRIES = int(os.environ.get('IDEM_FUZZ', '800')) // 8
LONG = [b'\xff' * 8, bytes(8), b'\xff\xff\xff\x7f' + bytes(4), (2**40).to_bytes(8, 'little')]


def mcap_of(path, messages, **options):
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=3000, **options)
        writer.start(profile='ros2')
        channels = {}
        for topic, log_time, message in messages:
            kind = message.__msgtype__
            if topic not in channels:
                definition, _ = typestore().generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, 'ros2msg', definition.encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            raw = bytes(typestore().serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, raw, log_time)
        writer.finish()
    return path


def zstd(folder, messages):
    return mcap_of(folder / 'x.mcap', messages, compression=CompressionType.ZSTD)


def lz4_without_index(folder, messages):
    options = {'index_types': IndexType.NONE, 'use_statistics': False}
    return mcap_of(folder / 'x.mcap', messages, compression=CompressionType.LZ4, **options)


def without_chunks(folder, messages):
    return mcap_of(folder / 'x.mcap', messages, use_chunking=False)


def db3(folder, messages):
    write_sqlite3(folder / 's', messages)
    return folder / 's' / 's.db3'


def bz2(folder, messages):
    write_rosbag1(folder / 'x.bag', messages, Writer1.CompressionFormat.BZ2, chunk=5000)
    return folder / 'x.bag'


def mutated(content, rng):
    """Return bytes with a few places changed, cut, doubled or filled."""
    content = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 5, 30])):
        at, length = int(rng.integers(max(len(content), 1))), int(rng.integers(1, 300))
        kind = rng.integers(5)
        if kind == 0:
            content[at : at + 1] = rng.bytes(1)
        elif kind == 1:
            content[at : at + 8] = LONG[rng.integers(len(LONG))]
        elif kind == 2:
            del content[at : at + length]
        elif kind == 3:
            content[at:at] = content[-length:]
        elif rng.random() < 0.3:
            del content[at:]
    return bytes(content)


@pytest.mark.parametrize(
    'write', [bare_mcap, zstd, lz4_without_index, without_chunks, ros1_bag, bz2, db3]
)
def test_a_recording_of_any_bytes_is_read_or_refused_in_one_line(tmp_path, write):
    path = write(tmp_path, scans(np.random.default_rng(0), points=50))
    content = path.read_bytes()
    read = 0
    for seed in range(TRIES):
        path.write_bytes(mutated(content, np.random.default_rng(seed)))
        said = []
        try:
            with open_recording(path) as recording:
                for topic in recording.topics:
                    try:
                        times = [time for _, time, _ in recording.messages([topic])]
                    except IdemError as error:
                        said.append(str(error))
                    else:
                        read += len(times)
                        assert all(a <= b for a, b in pairwise(times)) or recording.warnings
                said += recording.warnings
        except IdemError as error:
            said.append(str(error))
        assert all('\n' not in each and len(each) < 1500 for each in said)
    assert read > TRIES


@pytest.mark.parametrize('form', ['ros2msg', 'ros2idl'])
def test_a_definition_of_any_text_is_compared_or_refused(form):
    text, _ = typestore().generate_msgdef(CLOUD, ros_version=2)
    if form == 'ros2idl':
        text = 'module a { struct B { sequence<long long, 3> x; string y[4]; }; };' * 5
    for seed in range(TRIES):
        spoilt = mutated(text.encode(), np.random.default_rng(seed)).decode('utf-8', 'replace')
        try:
            reason = difference(CLOUD, typestore(), parse(form, spoilt, CLOUD))
        except IdemError as error:
            reason = str(error)
        assert '\n' not in reason
