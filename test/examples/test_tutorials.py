"""Commands of a tutorial, run as they stand."""

import os
import re
import subprocess
import sys
from pathlib import Path

from clouds import error_of

from idem_ros.calibration.initial_extrinsics import read_starts, starts_of
from idem_ros.messages.transform_message import matrix_of
from idem_ros.recording.reader import open_recording
from idem_ros.results.result_file import read_result

DOCS = Path(__file__).resolve().parents[2] / 'docs'


def commands_of(name):
    """Return what a page shows indented, without setting up and what waits for a robot."""
    text = (DOCS / name).read_text()
    return '\n'.join(
        line.strip(' ') if not line.startswith('      ') else line[4:]
        for line in re.findall(r'^    .*$', text, re.MULTILINE)
        if 'activate' not in line
    )


def ran(commands, folder):
    """Run commands in a folder; return what they print."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    done = subprocess.run(
        ['bash', '-euc', commands],
        cwd=folder,
        env={**os.environ, 'PATH': path},
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_tutorial_of_the_audit_does_what_it_says(tmp_path):
    said = ran(commands_of('tutorial_audit.md'), tmp_path)
    assert 'not good enough: exit code 1' in said
    frames = read_result(tmp_path / 'audit.json').frames
    verdicts = [frame['verdict'] for frame in frames]
    assert len(verdicts) == 21
    assert 2 <= verdicts.count('misaligned') <= 8
    assert verdicts[19] == 'misaligned'
    assert (tmp_path / 'frame.html').stat().st_size < 15e6


def test_the_page_about_rigs_finds_where_the_sensors_truly_are(tmp_path):
    commands = commands_of('calibrate.md').splitlines()
    said = ran('\n'.join(line for line in commands if 'rig.mcap' in line), tmp_path)
    speed = float(re.search(r'the rig moved, by up to (\S+) m/s', said)[1])
    assert abs(speed - 5.0) < 0.2
    names = ['lidar_0', 'lidar_1', 'lidar_2']
    found = starts_of(read_starts(tmp_path / 'rig' / 'extrinsics.yaml', names), names)
    with open_recording(tmp_path / 'rig.mcap') as recording:
        truth = [matrix_of(message) for _, _, message in recording.messages(['/ground_truth'])]
    for pose, T in zip(found[1:], truth, strict=True):
        degrees, distance = error_of(pose, T)
        assert degrees < 0.15
        assert distance < 0.02
