"""Find the recordings in a folder, each once, however many files it has."""

import os
import re
from pathlib import Path

from idem_ros.recording.folder import METADATA, SUFFIXES, UnreadableRecording, is_recording


def recordings_in(path):
    """Return the recordings that a path means, in the order of their names.

    A file is itself, whatever it holds. A folder is one recording where it is a rosbag2 folder:
    it has a metadata.yaml, or lost it, but its recordings bear its name and a number each
    (drive/drive_0.mcap). Any other folder is searched with all folders in it; hidden files and
    folders are left out, links to folders are not followed.

    Args:
        path: file or folder.

    Returns:
        [`Path`]

    Raises:
        UnreadableRecording: there is no such path, or no recording in the folder.
    """
    path = Path(path)
    if not path.is_dir():
        if not path.exists():
            raise UnreadableRecording(f'{path} does not exist; give recordings or a folder')
        return [path]
    found = list(_searched(path))
    if not found:
        raise UnreadableRecording(f'{path} holds no recording ({", ".join(SUFFIXES)})')
    return found


def _searched(folder):
    for parent, folders, names in os.walk(folder):
        parent = Path(parent)
        files = sorted(name for name in names if is_recording(name))
        if METADATA in names or _is_split(parent.resolve().name, files):
            folders.clear()
            yield parent
            continue
        folders[:] = sorted(name for name in folders if not name.startswith('.'))
        yield from (parent / name for name in files)


def _is_split(folder_name, files):
    numbered = re.compile(rf'{re.escape(folder_name)}_\d+\.(mcap|db3)(\.zstd|\.zst)?')
    return bool(files) and all(map(numbered.fullmatch, files))
