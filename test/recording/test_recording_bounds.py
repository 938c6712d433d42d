"""Chunks that declare or inflate beyond a bound are left out, named, and never inflated."""

import bz2

import lz4.frame
import pytest
import zstandard
from mcap.writer import CompressionType, Writer
from recordings import scans, write_rosbag1
from rosbags.rosbag1 import Writer as Writer1

from idem_ros.commands.main import main
from idem_ros.messages.building import CLOUD
from idem_ros.recording.inflating import Damaged, TooLarge, inflated, inflated_message
from idem_ros.recording.messages import typestore
from idem_ros.recording.reader import open_recording

BOUND = 200_000
COMPRESS = {
    'zstd': zstandard.ZstdCompressor().compress,
    'lz4': lz4.frame.compress,
    'bz2': bz2.compress,
}


def with_bomb(path, rng, compression, size, **options):
    definition, _ = typestore().generate_msgdef(CLOUD, ros_version=2)
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=10_000, compression=compression, **options)
        writer.start(profile='ros2')
        schema = writer.register_schema(CLOUD, 'ros2msg', definition.encode())
        for topic, log_time, message in scans(rng):
            if message.__msgtype__ != CLOUD:
                continue
            channel = writer.register_channel(topic, 'cdr', schema)
            raw = bytes(typestore().serialize_cdr(message, CLOUD))
            writer.add_message(channel, log_time, raw, log_time)
        bomb = writer.register_channel('/source', 'cdr', schema)
        writer.add_message(bomb, log_time + 9, b'\0\1\0\0' + bytes(size), log_time)
        writer.finish()
    return path


@pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])
@pytest.mark.parametrize('options', [{}, {'use_statistics': False}], ids=['indexed', 'scanned'])
def test_a_chunk_that_declares_too_much_is_left_out_and_named(tmp_path, rng, compression, options):
    path = with_bomb(tmp_path / 'x.mcap', rng, compression, 2 * BOUND, **options)
    with open_recording(path, max_chunk=BOUND) as recording:
        assert len(list(recording.messages(['/source', '/target']))) >= 2
    assert recording.lost['chunks_left_out'] == 1
    (warning,) = recording.warnings
    assert f'more than --max-chunk {BOUND}' in warning


@pytest.mark.parametrize('compression', COMPRESS)
def test_what_inflates_to_other_than_it_declares_is_damaged(compression):
    packed = COMPRESS[compression](bytes(10**7))
    assert inflated(packed, compression, 10**7, 10**7) == bytes(10**7)
    with pytest.raises(TooLarge):
        inflated(packed, compression, 10**7, 10**7 - 1)
    for size in (5, 10**7 - 1, 10**7 + 1):
        with pytest.raises(Damaged, match='bytes it declares'):
            inflated(packed, compression, size, 10**8)
    with pytest.raises(Damaged):
        inflated(b'nothing of the kind', compression, 100, 1000)
    with pytest.raises(Damaged, match='is not known'):
        inflated(packed, 'zip', 10**7, 10**7)


def test_a_message_that_is_compressed_by_itself_is_bounded_too():
    packed = zstandard.ZstdCompressor().compress(bytes(1000))
    silent = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(1000))
    by_lz4 = [lz4.frame.compress(bytes(1000), store_size=is_said) for is_said in (True, False)]
    for each in (packed, memoryview(silent), *by_lz4):
        assert inflated_message(each, 1000) == bytes(1000)
        with pytest.raises(TooLarge):
            inflated_message(each, 999)
    assert inflated_message(b'\0\1\0\0abc', 1) == b'\0\1\0\0abc'


def test_chunks_of_a_ros_1_bag_are_bounded(tmp_path, rng):
    path = tmp_path / 'x.bag'
    write_rosbag1(path, scans(rng, points=4000), Writer1.CompressionFormat.BZ2, chunk=10_000)
    with open_recording(path, max_chunk=20_000) as recording:
        read = list(recording.messages(recording.topics))
    assert len(read) < 10
    assert recording.lost['chunks_left_out'] >= 1
    assert 'more than --max-chunk 20000' in recording.warnings[0]


def test_the_bound_is_an_option_that_takes_units(tmp_path, rng, capsys):
    path = str(with_bomb(tmp_path / 'x.mcap', rng, CompressionType.ZSTD, 2**20))
    main(['replay', path, '--max-chunk', '512k', '--initial-guess-type', 'identity'])
    assert 'more than --max-chunk 524288' in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(['replay', path, '--max-chunk', 'much'])
    assert "'much' is no number of bytes" in capsys.readouterr().err
