"""The folder of ROS's log files: without one that can be written, rcl ends the process."""

import logging
import os
import tempfile
from pathlib import Path

LOG = logging.getLogger(__name__.partition('.')[0])
WITHOUT_FILE = ['--ros-args', '--disable-external-lib-logs', '--']


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
