"""Who publishes to a node that was killed forgets it before the next one listens."""

import os
from xml.etree import ElementTree

import pytest

from idem_ros.files.installed_file import installed_file
from idem_ros.node.environment import (
    IN_THE_WORKING_FOLDER,
    LARGE_CLOUDS,
    LOCALHOST_ONLY,
    PROFILE,
    RANGE,
    VARIABLE,
    prefer_short_lease,
)

RESTART_S = 1.0  # [s] a node takes at least from its start until it listens


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder of a user without a profile who discovers nothing but this machine."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(VARIABLE, '')
    monkeypatch.setenv(RANGE, 'LOCALHOST')
    monkeypatch.delenv(LOCALHOST_ONLY, raising=False)
    return tmp_path


def test_user_without_a_profile_gets_the_short_lease_on_one_machine(folder):
    prefer_short_lease()
    assert os.environ[VARIABLE] == str(installed_file(PROFILE))


def test_lease_is_left_alone_where_other_machines_are_discovered(folder, monkeypatch):
    monkeypatch.delenv(RANGE)
    prefer_short_lease()
    assert not os.environ[VARIABLE]


def test_profile_of_the_user_is_left_alone(folder, monkeypatch):
    monkeypatch.setenv(VARIABLE, 'mine.xml')
    prefer_short_lease()
    assert os.environ[VARIABLE] == 'mine.xml'


def test_profile_in_the_working_folder_is_left_alone(folder):
    (folder / IN_THE_WORKING_FOLDER).touch()
    prefer_short_lease()
    assert not os.environ[VARIABLE]


@pytest.mark.parametrize('profile', [PROFILE, LARGE_CLOUDS])
def test_killed_process_is_forgotten_before_the_next_one_listens(profile):
    tree = ElementTree.parse(installed_file(profile))
    lease, period = seconds_of(tree, 'leaseDuration'), seconds_of(tree, 'leaseAnnouncement')
    assert lease <= RESTART_S
    assert 5 * period <= lease, 'a process must not be forgotten for one announcement that is lost'


def seconds_of(tree, name):
    (period,) = (each for each in tree.iter() if each.tag.endswith('}' + name))
    values = {each.tag.split('}')[1]: int(each.text) for each in period}
    return values.get('sec', 0) + values.get('nanosec', 0) / 1e9
