"""Commands of a tutorial, run as they stand."""

import os
import re
import subprocess
import sys
from pathlib import Path

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


def test_the_tutorial_of_the_audit_does_what_it_says(tmp_path):
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    done = subprocess.run(
        ['bash', '-euc', commands_of('tutorial_audit.md')],
        cwd=tmp_path,
        env={**os.environ, 'PATH': path},
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    assert 'not good enough: exit code 1' in done.stdout
    frames = read_result(tmp_path / 'audit.json').frames
    verdicts = [frame['verdict'] for frame in frames]
    assert len(verdicts) == 21
    assert 2 <= verdicts.count('misaligned') <= 8
    assert verdicts[19] == 'misaligned'
    assert (tmp_path / 'frame.html').stat().st_size < 15e6
