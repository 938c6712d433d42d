"""A ROS 2 graph on this machine that nobody else hears, for the demo and the tests."""

import os
import socket

from idem_ros.files.installed_file import installed_file

DOMAINS = 101  # the DDS ports of higher ids fall into the range of ephemeral ports
LARGE_CLOUDS = 'config/fastdds_large_clouds.xml'


def loopback_environment() -> dict[str, str]:
    """Return the variables of a domain of its own, on this machine only, fit for large clouds."""
    variables = {
        'ROS_DOMAIN_ID': str(_unused_domain()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }
    profile = installed_file(LARGE_CLOUDS)
    if profile is not None:
        variables['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(profile)
    return variables


def _unused_domain() -> int:
    """Return a domain id whose first participant's port is free, so that no process is in it."""
    first = os.getpid() % DOMAINS
    for domain in (1 + (first + step) % DOMAINS for step in range(DOMAINS)):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7400 + 250 * domain + 10))  # the port rule of DDSI-RTPS 9.6.1.1
            except OSError:
                continue
            return domain
    return 1 + first
