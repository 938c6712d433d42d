"""What the launch files declare alike, and refuse before anything is started; no ROS."""

import sys
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from idem_ros.core.exceptions import IdemError

FILES = ('refine.launch.py', 'replay.launch.py', 'audit.launch.py', 'rig.launch.py')
COMMON = {
    'use_sim_time': ('false', 'true: time is that of /clock'),
    'large_clouds': (
        'false',
        'true: Fast DDS with shared memory for clouds of megabytes, on this machine only; the '
        'publishers must use config/fastdds_large_clouds.xml, too',
    ),
}


def left_to_file(parameters: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Return {name: (default, what it is)} of parameters that a file sets where no word does."""
    return {name: ('', f'{what}; empty: as params_file says') for name, what in parameters.items()}


def declared(arguments: dict[str, tuple[str | None, str]]) -> list:
    """Return the declarations of {name: (default, what it is)}; None: it must be given."""
    # it has no wheel: only a launch file can import it
    from launch.actions import DeclareLaunchArgument  # pyright: ignore[reportMissingImports]

    return [
        DeclareLaunchArgument(name, default_value=default, description=what)
        for name, (default, what) in arguments.items()
    ]


class LaunchRefused(IdemError):
    """Arguments with which a launch file starts nothing; `ros2 launch` prints the one line."""


def launched_file(command: Iterable[str] | None = None) -> str | None:
    """Return which launch file of this package is launched itself.

    Args:
        command: words of the command line; None: those of this process.

    Returns:
        Its name, or None where a launch file of somebody else includes ours.
    """
    words = sys.argv if command is None else command
    return next((Path(word).name for word in words if Path(word).name in FILES), None)


def require_known(given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse an argument that a launch file does not declare; launch itself ignores it.

    Args:
        given: words NAME:=VALUE, as they were given to launch.
        known: names that are declared.

    Raises:
        LaunchRefused: it names the argument, and what may be meant.
    """
    known = sorted(known)
    for word in given:
        name = word.partition(':=')[0]
        if name not in known:
            close = get_close_matches(name, known, 1)
            meant = f'{close[0]}?' if close else ', '.join(known)
            raise LaunchRefused(f'{word}: there is no launch argument {name}; {meant}')


def require_one_of(name: str, value: str, words: Iterable[str]) -> None:
    """Refuse a value that is none of some words.

    Raises:
        LaunchRefused: it names the argument, and what it may be.
    """
    if value not in (words := tuple(words)):
        raise LaunchRefused(f'{name}:={value}; it must be one of {", ".join(words)}')


def require_file(name: str, path: str) -> None:
    """Refuse a file that does not exist, or is none.

    Args:
        name: of the argument that says it.
        path: relative to where launch was started.

    Raises:
        LaunchRefused: it names argument and path.
    """
    if not path:
        raise LaunchRefused(f'{name}:= is empty; it must name a file')
    if not Path(path).exists():
        raise LaunchRefused(f'{name}:={path} does not exist (from {Path.cwd()})')
    if name == 'params_file' and not Path(path).is_file():
        raise LaunchRefused(f'{name}:={path} is no file')


def require_rviz() -> None:
    """Refuse to start RViz where it is not installed.

    Raises:
        LaunchRefused: it says how to go on without.
    """
    from ament_index_python.packages import PackageNotFoundError, get_package_prefix

    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        raise LaunchRefused(
            'rviz2 is not installed: give rviz:=false, or install it (apt install ros-jazzy-rviz2)'
        ) from None
