"""`idem demo`: what it shows, and when it fails."""

import os

import pytest
from live import rclpy  # noqa: F401  (before the messages, so that they check their fields)

# isort: split
import numpy as np
from recordings import scans

from idem_ros.commands import demo
from idem_ros.commands.main import main
from idem_ros.recording.writer import write_mcap


@pytest.fixture(autouse=True)
def own_environment(monkeypatch):
    for name in (
        'ROS_DOMAIN_ID',
        'ROS_AUTOMATIC_DISCOVERY_RANGE',
        'FASTRTPS_DEFAULT_PROFILES_FILE',
    ):
        monkeypatch.setenv(name, os.environ.get(name, ''))


@pytest.fixture
def write(tmp_path):
    def write(logged):
        path = tmp_path / 'drive.mcap'
        write_mcap(path, logged)
        return str(path)

    return write


def test_demo_shows_every_scan_and_a_summary(write, rng, capsys):
    assert main(['demo', write(scans(rng, points=1500))]) == 0
    lines = capsys.readouterr().out.splitlines()
    for number in (1, 2, 3):
        (line,) = [line for line in lines if line.startswith(f'  {number}/3 ')]
        assert line.count(' cm ') == 2
        assert ' -> ' in line
    assert '3 of 3 scans refined, median error:' in lines


def test_scan_that_is_refused_is_shown_with_the_reason_and_fails_the_demo(write, rng, capsys):
    logged = list(scans(rng, points=1500))
    spoiled = logged[4][2]
    assert logged[4][0] == '/source'
    spoiled.data = np.zeros_like(spoiled.data)
    assert main(['demo', write(logged)]) == 1
    output = capsys.readouterr()
    assert '  2/3  source: none of its' in output.out
    assert 'idem: error: 1 of 3 scans are missing' in output.err


def test_demo_fails_where_no_answer_can_come(write, rng, capsys, monkeypatch):
    monkeypatch.setattr(demo, 'PATIENCE', 0.2)
    logged = [each for each in scans(rng) if each[0] != '/target']
    for _, _, message in (each for each in logged if each[0] == '/initial_guess'):
        message.header.frame_id = 'elsewhere'
    target = next(each for each in scans(rng) if each[0] == '/target')
    assert main(['demo', write([target, *logged])]) == 1
    output = capsys.readouterr()
    assert "'elsewhere'" in output.out
    assert 'none of 3 scans was answered' in output.err


def test_demo_fails_where_the_refinement_does_not_help(write, rng, capsys):
    # guesses that are the truth: noise can only take the result away from it
    assert main(['demo', write(scans(rng, perturbation=(0.0, 0.0)))]) == 1
    assert 'the refinement did not help: the median' in capsys.readouterr().err


@pytest.mark.parametrize('missing', ['/initial_guess', '/ground_truth'])
def test_recording_without_guess_or_truth_is_refused(write, rng, capsys, missing):
    logged = [each for each in scans(rng) if each[0] != missing]
    assert main(['demo', write(logged)]) == 2
    assert 'lacks the guess or the truth' in capsys.readouterr().err


def test_recording_of_the_checkout_is_the_default(monkeypatch, capsys):
    monkeypatch.setattr(demo, 'BAG', 'bags/absent.mcap')
    assert main(['demo']) == 2
    assert 'bags/absent.mcap lies in the checkout only' in capsys.readouterr().err
