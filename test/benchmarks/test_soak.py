"""The soak in small: it counts right, says what is missed, and leaves no process behind."""

import os
import signal
import subprocess
import sys
from xml.etree import ElementTree

import pytest
from conftest import ROOT
from live import LONG, own_environment, rclpy  # noqa: F401  (the soak is of the live side)

# isort: split
import psutil

from benchmarks.goal import Goal
from benchmarks.soak import __main__ as soak
from benchmarks.soak import parts
from benchmarks.soak.children import PLAYER, SoakFailed, played_by, started
from benchmarks.soak.flooder import garbage
from benchmarks.soak.footprint import Footprint, Sample
from benchmarks.soak.player import Played
from benchmarks.soak.stream import moving_stream, street_stream
from idem_ros.core import InvalidCloud
from idem_ros.messages.building import CLOUD
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.node.environment import loopback_environment
from idem_ros.recording.messages import typestore
from idem_ros.refinement.point_time_config import PointTimeConfig


def test_quick_soak_reaches_its_figures_and_leaves_no_process():
    command = [sys.executable, '-m', 'benchmarks.soak', '--quick']
    environment = {**own_environment(), 'IDEM_SOAK_TEST': str(os.getpid())}
    run = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=3 * LONG
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert 'MISSED' not in run.stdout
    assert '17 of 17 figures reached' in run.stdout
    assert not list(marked_processes(str(os.getpid())))


def marked_processes(mark):
    for process in psutil.process_iter():
        try:
            if process.environ().get('IDEM_SOAK_TEST') == mark:
                yield process
        except psutil.Error:
            continue


@pytest.fixture
def handlers():
    """Those of the signals, which the soak sets, again afterwards."""
    before = {each: signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)}
    yield
    for each, handler in before.items():
        signal.signal(each, handler)


def test_missed_figure_ends_with_exit_code_1(monkeypatch, capsys, handlers):
    part = parts.Part('one', [Goal('x', 2.0, 1.0)])
    monkeypatch.setattr(parts, 'PARTS', {'one': lambda size: part})
    assert soak.main(['--quick']) == 1
    assert 'MISSED' in capsys.readouterr().out


def test_a_part_that_there_is_not_is_refused_with_the_names_of_all(capsys, handlers):
    assert soak.main(['--quick', '--only', 'restarts']) == 1
    assert 'long_run, fast_run, moving_run, overload, killed' in capsys.readouterr().err


def test_processes_announce_themselves_faster_than_a_restart_may_take():
    profile = ElementTree.parse(loopback_environment()['FASTRTPS_DEFAULT_PROFILES_FILE'])
    (period,) = (each for each in profile.iter() if each.tag.endswith('}leaseAnnouncement'))
    seconds = {each.tag.split('}')[1]: int(each.text) for each in period}
    assert 0 < seconds.get('sec', 0) + seconds['nanosec'] / 1e9 <= parts.RESTART_S / 2


def test_every_cloud_of_the_stream_has_as_many_points_as_asked_for_and_the_stamp():
    (tick,) = street_stream(500, 1)
    sent = tick.stamped(1_700_000_000_123_456_789)
    for name in ('target', 'source'):
        message = typestore().deserialize_cdr(sent[name], CLOUD)
        assert stamp_ns(message) == 1_700_000_000_123_456_789
        assert len(read_points(message).points) == 500
    assert message.header.frame_id == 'lidar'


def test_a_sweep_of_the_stream_has_times_before_its_stamp_and_is_newer_than_its_target():
    (tick,) = moving_stream(500, 1)
    sent, stamp = tick.stamped(1_700_000_000_123_456_789), 1_700_000_000_123_456_789
    messages = [typestore().deserialize_cdr(sent[name], CLOUD) for name in ('target', 'source')]
    assert [stamp_ns(each) - stamp for each in messages] == [-(10**8), 0]
    for each in messages:
        times = read_points(each, PointTimeConfig()).times.times
        assert len(times) == 500
        assert -0.1 - 1e-6 <= times.min() < times.max() <= 0.0


def test_growth_threads_and_open_files_are_held_after_the_first_minute():
    part = parts.Part('one')
    samples = [Sample(60.0 + i, 0.0, 1000 + i, 5, 9 + (i == 7)) for i in range(100)]
    parts._hold_footprint(part, samples)
    assert [(goal.figure, goal.reached) for goal in part.goals] == [
        ('growth of the memory', False),
        ('threads that came or went', True),
        ('open files that came or went', False),
    ]


def test_slowest_of_the_restarts_is_judged_and_a_silent_node_is_counted():
    part, second = parts.Part('one'), 10**9
    answered = dict(enumerate(int(at * second) for at in (1, 12.1, 12.4, 22.7)))
    kills = [10 * second, 20 * second, 30 * second]
    readies = [0, 12 * second, 22 * second, 32 * second]
    parts._hold_restarts(part, parts.Size(), Played(answered=answered), kills, readies)
    silent, slowest = part.goals
    assert (silent.measured, silent.reached) == (1, False)
    assert slowest.measured == pytest.approx(0.7)
    assert part.notes == ['from "ready" to the first transform: 0.10, 0.70 s']


def test_footprint_of_a_process_that_ended_stays_what_it_was_last():
    with started([sys.executable, '-c', 'input()'], stdin=subprocess.PIPE) as process:
        footprint = Footprint(process.pid)
        process.communicate()
    footprint.sample()
    assert len(footprint.samples) == 1
    assert 'threads' in footprint.line()


def test_sources_that_are_neither_answered_nor_dropped_are_counted():
    load = {'received': '9', 'answered': '4', 'refused': '1', 'dropped': '2'}
    assert Played(load=load).unsettled == 2


@pytest.mark.parametrize('does', ['raise SystemExit(3)', 'import signal; signal.pause()'])
def test_player_that_fails_or_does_not_end_is_reported(does):
    command = [PLAYER[0], '-c', does]
    with (
        started(command, stdout=subprocess.PIPE, text=True) as player,
        pytest.raises(SoakFailed, match='exit code 3|did not end'),
    ):
        played_by(player, patience=LONG if 'Exit' in does else 0.0)
    assert player.returncode is not None


def test_what_floods_the_targets_is_refused_and_what_floods_the_sources_is_no_good(rng):
    of_source, of_target = garbage(rng)
    for cdr in of_target:
        with pytest.raises(InvalidCloud):
            read_points(typestore().deserialize_cdr(cdr, CLOUD))
    assert len(of_source) > len(of_target)
