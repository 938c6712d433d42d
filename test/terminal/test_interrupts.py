"""Ctrl-C at random moments: exit code 130, one line, whole files, no process left.

IDEM_INTERRUPTS=50 asks for so many moments of each command (`make fuzz` does); one without.
"""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from recordings import scans
from results import write_result

from idem_ros.commands.main import command_line
from idem_ros.recording.embedded import MAGIC
from idem_ros.recording.writer import write_mcap

MOMENTS = int(os.environ.get('IDEM_INTERRUPTS', '1'))
# Ctrl-C in the start of Python itself is Python's own, so the moments count from the first line
IDEM = [
    sys.executable,
    '-c',
    'from idem_ros.commands.entry import main; print(flush=True); raise SystemExit(main())',
]
COMMANDS = {
    'replay': 'replay scans.mcap --json OUT/a.json --out OUT/a.mcap --tum OUT/a.tum',
    'sequence': 'replay scans.mcap --sequence submap --json OUT/a.json',
    'methods': 'replay scans.mcap --method idem,gicp --json OUT/a.json',
    'evaluate': 'evaluate scans.mcap more.mcap --jobs 2 --out OUT/results',
    'experiments': 'experiments run table2 --quick --out OUT/paper',
    'report': 'report result.json --out OUT/report',
    'gate': 'gate result.json --rules rules.yaml --junit OUT/gate.xml',
    'compare': 'compare result.json other.json',
    'again': 'replay --again made.json',
    'simulate': 'simulate --scans 3 --out OUT/a.mcap',
    'bag': 'bag a.xyz b.xyz --out OUT/a.mcap',
    'register': 'register a.xyz b.xyz --out OUT/T.txt',
    'align': 'align a.xyz b.xyz c.xyz --out OUT/poses.g2o --picture OUT/a.png',
    'calibrate': 'calibrate a.xyz b.xyz c.xyz --voxel-size 0.1 --out OUT/rig',
    'smooth': 'smooth scans.mcap --trajectory scans.tum --jobs 2 --out OUT/smoothed',
    'show': 'show made.json --out OUT/page.html',
    'map': 'map tile a.xyz --size 1 --out OUT/tiles',
    'in a map': 'replay scans.mcap --target-file a.xyz --json OUT/a.json',
    'trajectory': 'trajectory scans.tum scans.tum',
    'truth': 'truth scans.mcap --out OUT/truth.tum',
    'list': 'experiments list',
    'play': 'play scans.mcap --rate 0.1',
    'demo': 'demo scans.mcap',
}
NEED_ROS = 'play', 'demo'
# what comes of points at random: no pose, or poses that are not aligned
MAY_FAIL = 'register', 'align', 'calibrate', 'smooth', 'in a map', 'play', 'demo'
LONGEST = 4.0  # [s] until Ctrl-C; of several moments the first is at the end, and tells how long
PATIENCE = 30.0  # [s]
# what a command says on its way; what evaluate says of each recording begins with [
NOTE = re.compile(r'idem( \w+)?: (?!error: |interrupted|terminated|terminal closed)|\[')


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    import numpy as np

    folder = tmp_path_factory.mktemp('inputs')
    write_mcap(folder / 'scans.mcap', scans(np.random.default_rng(0), 6))
    write_mcap(folder / 'more.mcap', scans(np.random.default_rng(1), 4))
    for name in ('result', 'other'):
        write_result(folder / f'{name}.json', q_tot=[1.0] * 8, time_ms=[2.0] * 8)
    (folder / 'rules.yaml').write_text('rules: [frames > 1]')
    for name in 'abc':
        np.savetxt(
            folder / f'{name}.xyz', np.random.default_rng(ord(name)).uniform(0, 3, (2000, 3))
        )
    made = [*IDEM, 'replay', 'scans.mcap', '--json', 'made.json', '--tum', 'scans.tum']
    subprocess.run(made, cwd=folder, capture_output=True, check=True)
    truth = [*IDEM, 'truth', 'scans.mcap', '--out', 'scans.tum']
    subprocess.run(truth, cwd=folder, capture_output=True, check=True)
    return folder


def processes_of(session):
    """Return the processes of a session that are not dead."""
    found = []
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            _, _, rest = stat.read_text().rpartition(')')
        except OSError:
            continue
        state, _, _, sid = rest.split()[:4]
        if int(sid) == session and state not in 'ZX':
            found.append(stat.parent.name)
    return found


def environment_of(name):
    """Return that of a command: with ROS in a domain of its own."""
    if name not in NEED_ROS:
        return None
    pytest.importorskip('rclpy', reason='needs rclpy, which is not installed')
    from idem_ros.node.environment import loopback_environment

    return {**os.environ, **loopback_environment()}


def run(folder, arguments, moment=None, to_all=False, env=None, signum=signal.SIGINT):
    """Run a command, send a signal at a moment [s]; return (code, lines of stderr)."""
    child = subprocess.Popen(
        [*IDEM, *arguments],
        cwd=folder,
        env=env,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    child.stdout.readline()
    try:
        _, err = child.communicate(timeout=moment)
    except subprocess.TimeoutExpired:
        # of a terminal it goes to all, by `kill` to one
        (os.killpg if to_all else os.kill)(child.pid, signum)
        _, err = child.communicate(timeout=120)
    for _ in range(100):  # the processes of a pool are reaped when their pipes close
        if not processes_of(child.pid):
            break
        signal.sigtimedwait([], 0.05)
    assert processes_of(child.pid) == []
    return child.returncode, [each for each in err.splitlines() if each]


def require_whole(folder):
    """Every file that is there is complete, and nothing else is."""
    for path in (each for each in folder.rglob('*') if each.is_file()):
        content = path.read_bytes()
        assert content, path
        assert '.part' not in path.name
        if path.suffix == '.json':
            json.loads(content)
        if path.suffix == '.mcap':
            assert content.endswith(MAGIC)


@pytest.mark.parametrize('name', COMMANDS)
def test_ctrl_c_at_any_moment_ends_a_command_in_order(folder, tmp_path, name):
    rng, env, longest = random.Random(name), environment_of(name), LONGEST
    for i in range(MOMENTS):
        out = tmp_path / str(i)
        out.mkdir()
        is_measured, begin = i == 0 and MOMENTS > 1, time.monotonic()
        moment = PATIENCE if is_measured else rng.uniform(0.0, longest)
        to_all, arguments = rng.random() < 0.5, with_out(COMMANDS[name].split(), out)
        code, lines = run(folder, arguments, moment, to_all, env)
        longest = min(time.monotonic() - begin, PATIENCE) if is_measured else longest
        if code == 130:
            said = [each for each in lines if not NOTE.match(each)]
            assert said in ([], ['idem: interrupted']), moment  # a replay says so in its report
        else:
            assert code == 0 or (code == 1 and name in MAY_FAIL), (moment, lines)
            assert 'Traceback' not in str(lines)
        require_whole(out)


@pytest.mark.parametrize(
    ('signum', 'said'),
    [(signal.SIGTERM, 'idem: terminated'), (signal.SIGHUP, 'idem: terminal closed')],
)
@pytest.mark.parametrize('name', ['show', 'smooth', 'simulate'])
def test_what_is_terminated_leaves_nothing_behind_either(folder, tmp_path, name, signum, said):
    """As of `docker stop`, a shutdown, or a terminal that is closed."""
    moment = random.Random(f'{name}{signum}').uniform(0.5, LONGEST)
    code, lines = run(folder, with_out(COMMANDS[name].split(), tmp_path), moment, signum=signum)
    if code == 128 + signum:
        assert [each for each in lines if not NOTE.match(each)] == [said]
    else:
        assert code == 0 or (code == 1 and name in MAY_FAIL), (moment, lines)
    require_whole(tmp_path)


@pytest.mark.parametrize('signum', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_half_a_file_and_half_a_folder_go_with_whatever_ends_the_command(tmp_path, signum):
    script = f"""
import signal, sys
signal.signal({signum}, signal.SIG_DFL)  # nohup has SIGHUP ignored
from pathlib import Path
from idem_ros.commands import entry, main
from idem_ros.files.atomic_file import filling, replacing

def run(args):
    with replacing('a.txt') as file, filling('b') as folder:
        file.write_text('half')
        (folder / 'c.txt').write_text('half')
        signal.raise_signal({signum})

main.register.run = run
sys.argv = ['idem', 'register', 'a', 'b']
sys.exit(entry.main())
"""
    command = [sys.executable, '-c', script]
    ended = subprocess.run(command, cwd=tmp_path, stderr=subprocess.DEVNULL, timeout=60)
    assert ended.returncode == 128 + signum
    assert list(tmp_path.iterdir()) == []


def test_every_command_is_interrupted():
    def words_of(parser, words=()):
        commands = [each.choices for each in parser._actions if isinstance(each.choices, dict)]
        if not commands:
            yield ' '.join(words)
        for choices in commands:
            for name, command in choices.items():
                yield from words_of(command, (*words, name))

    missing = [
        words
        for words in words_of(command_line())
        if not any(f'{line} '.startswith(f'{words} ') for line in COMMANDS.values())
    ]
    assert missing == []


def with_out(arguments, folder):
    return [each.replace('OUT', str(folder)) for each in arguments]
