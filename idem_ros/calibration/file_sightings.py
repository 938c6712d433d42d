"""Sightings of a rig in files: one file a sensor, or a folder an instant with a file a sensor."""

from pathlib import Path

from idem_ros.calibration.synchronized_scans import Measured, Sighting
from idem_ros.core.exceptions import IdemError
from idem_ros.files.cloud_file import READERS
from idem_ros.files.cloud_list import refuse_copy, refuse_same_files


class UnclearSightings(IdemError):
    """Files of which it cannot be told which sensor and which instant they are of."""


def files_of(paths):
    """Return (names of the sensors, {instant: {sensor: file}}) of files, or of folders.

    Args:
        paths: files, one a sensor, of one instant; or folders, one an instant, in which a
            sensor's file has the same name, whatever its suffix.

    Raises:
        UnclearSightings, RepeatedCloud: it says what is wrong.
    """
    paths = [Path(each) for each in paths]
    folders = [each for each in paths if each.is_dir()]
    if folders and len(folders) < len(paths):
        other = next(each for each in paths if each not in folders)
        raise UnclearSightings(
            f'{folders[0]} is a folder and {other} is none: give a file for each sensor, or a '
            'folder for each instant'
        )
    refuse_same_files(paths)
    missing = [str(each) for each in paths if not each.exists()]
    if missing:
        raise UnclearSightings(f'{", ".join(missing)}: there is no such file')
    if not folders:
        found = {'1': _by_name(paths)}
    else:
        found = {str(folder): _by_name(_clouds_in(folder)) for folder in folders}
    names = list(dict.fromkeys(name for files in found.values() for name in files))
    if len(names) < 2:
        raise UnclearSightings(f'there is one sensor, {names[0]}: two at least are calibrated')
    return names, found


def sightings_of(names, found, read):
    """Return the `Sighting` of each instant, and a line about each cloud that cannot be read.

    Args:
        names: of the sensors, the reference first.
        found: {instant: {sensor: file}}.
        read: read(file) returns (N, 3) points.

    Raises:
        RepeatedCloud: two sensors have the same points.
    """
    sightings, flaws = [], []
    for instant, files in found.items():
        measured, seen = [], {}
        for name in names:
            points = None
            if name not in files:
                flaws.append(f'{name} has no file in {instant}')
            else:
                try:
                    points = read(files[name])
                except IdemError as error:
                    flaws.append(f'{name} is left out: {error}')
            if points is not None:
                refuse_copy(files[name], points, seen)
            measured.append(None if points is None else Measured(points))
        sightings.append(Sighting(instant, tuple(measured)))
    return sightings, flaws


def _clouds_in(folder):
    files = [each for each in sorted(folder.iterdir()) if _is_cloud(each)]
    if not files:
        raise UnclearSightings(f'{folder} holds no cloud; it must hold one for each sensor')
    return files


def _is_cloud(path):
    # tables beside clouds hold anything: names, poses, notes
    suffix = path.suffix.lower()
    is_cloud = suffix in READERS and suffix not in ('.txt', '.csv')
    return is_cloud and path.is_file() and not path.name.startswith('.')


def _by_name(files):
    found = {}
    for file in files:
        if file.stem in found:
            raise UnclearSightings(
                f'{found[file.stem]} and {file} have the same name, which is the name of the '
                'sensor: rename one'
            )
        found[file.stem] = file
    return found
