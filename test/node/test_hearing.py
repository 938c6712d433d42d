"""A node hears what is published to it, whatever a killed process has left."""

import os
import subprocess

import pytest
from live import own_environment, rclpy, wait_for_line  # noqa: F401  (the node needs it)

# isort: split
from rclpy.node import Node

from benchmarks.soak.children import started
from idem_ros.node import hearing
from idem_ros.node.hearing import Hearing, PortLost
from idem_ros.node.ports import SECOND_NAME, SHARED_MEMORY, OwnPorts, no_dead_ports
from idem_ros.node.process import node_command


class Lines(list):
    """A logger that keeps what is said."""

    def info(self, message):
        self.append(message)

    warning = info


class Silent:
    """Inputs that were subscribed to, of which some have publishers."""

    def __init__(self, published):
        self.held = {'target': [], 'source': []}
        self.published, self.renewed = published, []

    def could_hear(self, name):
        return name in self.published

    def renew(self, name):
        self.renewed.append(name)
        return f'/{name}'


@pytest.fixture
def ports(context):
    """The names of the ports that this process listens at, by its own account."""
    node = Node('listener', context=context)
    yield OwnPorts()
    node.destroy_node()


def second_names(pid):
    return list(SHARED_MEMORY.glob(f'{SECOND_NAME}*_{pid}'))


def port_of(second):
    return second.name.removeprefix(SECOND_NAME).partition('_')[0]


def names_of(ports):
    names = [SHARED_MEMORY / f'fastrtps_port{port}' for port in ports._kept]
    return names or pytest.skip('Fast DDS uses no shared memory here')


def test_port_that_lost_its_name_gets_it_back(ports):
    names = names_of(ports)
    before = [name.stat().st_ino for name in names]
    assert ports.keep() == 0
    names[0].unlink()
    assert ports.keep() == 1
    assert [name.stat().st_ino for name in names] == before
    ports.close()


def test_port_whose_name_another_one_bears_gets_it_back(ports):
    name = names_of(ports)[0]
    before = name.stat().st_ino
    name.unlink()
    name.write_bytes(b'made by a sender')
    assert ports.keep() == ports.restored == 1
    assert name.stat().st_ino == before
    ports.close()


def test_port_that_lost_both_names_is_lost_and_said_to_be(ports, monkeypatch):
    monkeypatch.setattr(Hearing, 'lost', 0)
    names_of(ports)
    second = second_names(os.getpid())[0]
    name = SHARED_MEMORY / f'fastrtps_port{port_of(second)}'
    name.unlink()
    second.unlink()
    listening = Hearing(Lines())
    for _ in range(hearing.LOST - 2):
        listening.attend(Silent(()), 0.0)
    with pytest.raises(PortLost, match='nobody reaches it'):
        listening.attend(Silent(()), 0.0)
    assert Hearing(Lines()).anew == 1
    listening.close()


def test_second_names_are_removed_with_the_node_and_those_of_the_dead_at_the_next_start(ports):
    names_of(ports)
    ports.close()
    left = SHARED_MEMORY / f'{SECOND_NAME}1_{2**22 + 1}'  # no such process
    left.touch()
    with no_dead_ports(0):
        pass
    assert not list(SHARED_MEMORY.glob(f'{SECOND_NAME}1_*'))


def test_silent_input_with_a_publisher_is_subscribed_to_anew_after_a_second_and_counted():
    lines, inputs = Lines(), Silent({'source'})
    listening = Hearing(lines)
    for now in (0.0, 0.9, 1.1, 2.0, 3.0, 3.2):
        listening.attend(inputs, now)
    assert inputs.renewed == ['source'] * 2
    assert listening.anew == 2
    assert lines[0] == 'nothing heard on /source, which is published: subscribed anew'
    listening.note('source')
    for now in range(4, 100):
        listening.attend(inputs, float(now))
    assert listening.anew == 2
    listening.close()


def test_patience_with_a_publisher_that_says_nothing_grows():
    inputs = Silent({'target'})
    listening = Hearing(Lines())
    for now in range(1000):
        listening.attend(inputs, float(now))
    assert 5 < len(inputs.renewed) < 25
    assert hearing.LONGEST == 60.0
    listening.close()


def test_node_whose_ports_lost_their_names_answers_who_publishes_afterwards(monkeypatch):
    environment = own_environment()
    for name in environment.keys() & {'ROS_DOMAIN_ID', 'FASTRTPS_DEFAULT_PROFILES_FILE'}:
        monkeypatch.setenv(name, environment[name])
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    command = node_command({'reliability': 'reliable'}, 'info')
    with started(command, stderr=subprocess.PIPE, text=True, env=environment) as node:
        wait_for_line(node.stderr, 'ready')
        seconds = second_names(node.pid)
        for each in seconds:
            (SHARED_MEMORY / f'fastrtps_port{port_of(each)}').unlink()
        if not seconds:
            pytest.skip('Fast DDS uses no shared memory here')
        assert 'hears again' in wait_for_line(node.stderr, 'had lost its name')
