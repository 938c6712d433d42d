import subprocess
import sys

from conftest import ROOT


def test_spoilt_files_of_every_kind_end_in_order():
    kinds = 'clouds', 'recordings', 'results', 'parameters', 'maps', 'poses', 'sweeps', 'capsules'
    counts = [word for kind in kinds for word in (f'--{kind}', '3')]
    ended = subprocess.run(
        [sys.executable, str(ROOT / 'fuzz'), *counts, '--jobs', '1', '--seed', '1'],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert '0 faults' in ended.stdout


def test_a_fault_is_found_counted_and_named(tmp_path):
    script = f"""
import sys
sys.path.insert(0, {str(ROOT / 'fuzz')!r})
import children

class Cases:
    def write(self, rng):
        import idem_ros.commands.main as module
        def run(args):
            if args.target == '1':
                raise ZeroDivisionError
            if args.target == '2':
                import os
                os.abort()
            return 0
        module.register.run = run
        return ['register', str(next(numbers)), 'b']

numbers = iter(range(4))
for each in children.run_all({{'some': Cases()}}, {{'some': 4}}, 0, 1):
    print(each['index'], each['code'], each['fault'].strip().splitlines()[-1:])
"""
    ended = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.stdout.splitlines()[:2] == ['0 0 []', "1 None ['ZeroDivisionError']"]
    assert "2 -6 ['the process ended with -6']" in ended.stdout
