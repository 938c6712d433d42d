"""What ROS 2 needs of a process's environment: itself, a graph, a lease, a folder of logs."""

import logging
import os
import socket
import tempfile
from pathlib import Path

from idem_ros.core.exceptions import IdemError
from idem_ros.files.installed_file import installed_file

DOMAINS = 101  # the DDS ports of higher ids fall into the range of ephemeral ports
LARGE_CLOUDS = 'config/fastdds_large_clouds.xml'

VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
IN_THE_WORKING_FOLDER = 'DEFAULT_FASTRTPS_PROFILES.xml'  # Fast DDS reads it, too
PROFILE = 'config/fastdds_short_lease.xml'
RANGE, LOCALHOST_ONLY = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOCALHOST_ONLY'

LOG = logging.getLogger(__name__.partition('.')[0])
WITHOUT_FILE = ['--ros-args', '--disable-external-lib-logs', '--']


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


def prefer_short_lease() -> None:
    """Have Fast DDS take the short lease, unless the user gave it a profile.

    Only where discovery stays on this machine: a network may lose announcements for longer. To be
    called before rclpy is initialized.
    """
    is_local = os.environ.get(RANGE) == 'LOCALHOST' or os.environ.get(LOCALHOST_ONLY) == '1'
    is_given = os.environ.get(VARIABLE) or Path(IN_THE_WORKING_FOLDER).exists()
    if is_local and not is_given and (profile := installed_file(PROFILE)):
        os.environ[VARIABLE] = str(profile)


def logging_arguments() -> list[str]:
    """See to a folder that log files can be written to; return arguments of ROS to log with.

    Where that of the environment (ROS_LOG_DIR, ROS_HOME or the home) cannot be written, one of
    temporary files takes its place, and where there is none, no file is written; a line says so.
    """
    folder = _log_folder()
    try:
        _require_writable(folder)
    except (OSError, RuntimeError) as error:  # RuntimeError of pathlib: there is no home
        return _elsewhere(error)
    return []


def _elsewhere(error: Exception) -> list[str]:
    from idem_ros.core.kernel_cache import temporary_folder  # late: it takes numba with it

    try:
        folder = temporary_folder('log')
        _require_writable(folder)
    except OSError:
        LOG.warning('no log file is written (%s); ROS_LOG_DIR names a folder for it', error)
        return WITHOUT_FILE
    LOG.warning('log files go to %s (%s); ROS_LOG_DIR names another folder', folder, error)
    os.environ['ROS_LOG_DIR'] = str(folder)
    return []


def _log_folder() -> Path:
    """Return the folder that rcl takes."""
    environment = os.environ
    if folder := environment.get('ROS_LOG_DIR'):
        return Path(folder)
    return Path(environment.get('ROS_HOME') or '~/.ros', 'log')


def _require_writable(folder: Path) -> None:
    if str(folder).startswith('~'):
        home = os.environ.get('HOME')
        if not home:  # rcl asks nothing else
            raise RuntimeError('HOME is not set')
        folder = Path(home, *folder.parts[1:])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


class RclpyMissing(IdemError):
    """A command that works on live topics, where ROS 2 is not installed."""


def require_rclpy(program):
    """Raise `RclpyMissing` with what to install, unless rclpy and its messages can be imported.

    Args:
        program: who asks, such as 'idem play'.
    """
    try:
        import diagnostic_msgs.msg  # noqa: F401
        import rclpy  # noqa: F401
        import rosgraph_msgs.msg  # noqa: F401
        import sensor_msgs.msg  # noqa: F401
    except ImportError as error:
        raise RclpyMissing(
            f'{program} works on live ROS 2 topics and needs rclpy ({error}): '
            'source an installed Jazzy (. /opt/ros/jazzy/setup.sh), or install '
            '"ros-jazzy-rclpy[fastrtps]" and ros-jazzy-common-interfaces with pip'
        ) from error
