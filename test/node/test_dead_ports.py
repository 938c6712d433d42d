"""A node that starts takes over no port of a killed one."""

import fcntl
import os
import re
import subprocess
from pathlib import Path

import pytest
from live import own_environment, rclpy, wait_for_line  # noqa: F401  (the node needs it)

# isort: split
from benchmarks.soak.children import clean_shared_memory, started
from idem_ros.node import ports
from idem_ros.node.ports import FIRST_PORT, PORTS, no_dead_ports
from idem_ros.node.process import node_command


@pytest.fixture
def shared_memory(tmp_path, monkeypatch):
    """A folder with two ports of domain 3, one of domain 4, and what is none."""
    monkeypatch.setattr(ports, 'SHARED_MEMORY', tmp_path)
    for port in (8161, 8163, 8411):
        (tmp_path / f'fastrtps_port{port}').touch()
        (tmp_path / f'fastrtps_port{port}_el').touch()
    (tmp_path / 'fastrtps_portal_el').touch()
    return tmp_path


def is_held(lock):
    with lock.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def names(folder):
    return {file.name for file in folder.iterdir()}


def test_dead_ports_of_the_domain_are_held_and_then_removed(shared_memory):
    before = names(shared_memory)
    with no_dead_ports(3):
        assert is_held(shared_memory / 'fastrtps_port8161_el')
        assert is_held(shared_memory / 'fastrtps_port8163_el')
        assert not is_held(shared_memory / 'fastrtps_port8411_el')
        assert names(shared_memory) == before
    assert names(shared_memory) == {
        'fastrtps_port8411',
        'fastrtps_port8411_el',
        'fastrtps_portal_el',
    }


def test_port_whose_reader_lives_is_left_alone(shared_memory):
    lock = shared_memory / 'fastrtps_port8161_el'
    with lock.open() as reader:
        fcntl.flock(reader, fcntl.LOCK_EX)
        with no_dead_ports(3):
            pass
        assert is_held(lock)
    assert 'fastrtps_port8161' in names(shared_memory)
    assert 'fastrtps_port8163' not in names(shared_memory)


def test_locks_are_let_go_of_when_the_node_cannot_be_made(shared_memory):
    lock = shared_memory / 'fastrtps_port8161_el'
    with lock.open() as opened_before:
        with pytest.raises(RuntimeError), no_dead_ports(3):
            raise RuntimeError
        fcntl.flock(opened_before, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_machine_without_shared_memory_has_no_dead_ports(shared_memory, monkeypatch):
    monkeypatch.setattr(ports, 'SHARED_MEMORY', shared_memory / 'absent')
    with no_dead_ports(3):
        pass


def test_node_in_the_place_of_a_killed_one_listens_at_another_port():
    environment = own_environment()
    killed = port_of_a_node_that_is_killed(environment)
    after = port_of_a_node_that_is_killed(environment)
    clean_shared_memory()
    assert after != killed


def port_of_a_node_that_is_killed(environment):
    first = FIRST_PORT + PORTS * int(environment['ROS_DOMAIN_ID'])
    options = {'stderr': subprocess.PIPE, 'text': True, 'env': environment}
    with started(node_command({}, 'info'), **options) as node:
        wait_for_line(node.stderr, 'ready')
        maps = Path(f'/proc/{node.pid}/maps').read_text(encoding='utf-8')
        node.kill()
    (port,) = {int(port) for port in re.findall(r'/fastrtps_port(\d+)$', maps, re.M)} & {
        *range(first, first + PORTS)
    }
    return port


def test_segments_that_killed_processes_sent_from_are_removed(shared_memory):
    dead, living, new = (f'fastrtps_{name * 16}' for name in 'abc')
    for name in (dead, living, new):
        for file in (shared_memory / name, shared_memory / f'{name}_el'):
            file.touch()
            if name != new:
                os.utime(file, (0, 0))
    before = names(shared_memory)
    with (shared_memory / f'{living}_el').open() as owner:
        fcntl.flock(owner, fcntl.LOCK_EX)
        with no_dead_ports(9):
            pass
    assert before - names(shared_memory) == {dead, f'{dead}_el'}
