import socket
from xml.etree import ElementTree

from conftest import ROOT

from idem_ros.files.installed_file import installed_file
from idem_ros.node import environment
from idem_ros.node.environment import loopback_environment


def port_of(domain):
    return 7400 + 250 * int(domain) + 10


def test_domain_in_which_somebody_is_is_left_alone():
    first = loopback_environment()['ROS_DOMAIN_ID']
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as somebody:
        somebody.bind(('', port_of(first)))
        assert loopback_environment()['ROS_DOMAIN_ID'] != first


def test_domain_is_one_that_dds_has_ports_for():
    assert 1 <= int(loopback_environment()['ROS_DOMAIN_ID']) <= environment.DOMAINS


def test_discovery_stays_on_this_machine():
    variables = loopback_environment()
    assert variables['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    profile = ElementTree.parse(variables['FASTRTPS_DEFAULT_PROFILES_FILE'])
    addresses = [each.text for each in profile.iter() if each.tag.endswith('}address')]
    assert addresses == ['127.0.0.1']


def test_files_of_the_checkout_are_found_and_others_are_not():
    assert installed_file('config/refine.yaml') == ROOT / 'config' / 'refine.yaml'
    assert installed_file('config/absent.yaml') is None


def test_files_of_an_installation_are_found_under_share(tmp_path, monkeypatch):
    package = tmp_path / 'lib' / 'python' / 'site-packages' / 'idem_ros' / 'installed_file.py'
    installed = tmp_path / 'share' / 'idem_ros' / 'config' / 'refine.yaml'
    for file in (package, installed):
        file.parent.mkdir(parents=True)
        file.touch()
    monkeypatch.setattr('idem_ros.files.installed_file.__file__', str(package))
    assert installed_file('config/refine.yaml') == installed
