"""The folder that capsules are kept in: bounded in number and bytes, the oldest goes first."""

import re
from pathlib import Path

from idem_ros.capsules.capsule import write_capsule
from idem_ros.files.atomic_file import UnwritableFile

OURS = re.compile(r'idem_capsule_(\d{20})_\d{3}_[a-z_]+\.mcap')
"""Only what is named so is ever deleted."""


def keep(folder, seen, most, most_bytes):
    """Write a capsule into a folder, and delete the oldest capsules beyond the bounds.

    Args:
        folder: it is made where its parent exists.
        seen: `Seen`.
        most: capsules that may be in it.
        most_bytes: that they may have together; the newest stays in any case.

    Returns:
        The `Path` of the capsule.

    Raises:
        UnwritableFile: it cannot be written; what was there is as it was.
    """
    folder = Path(folder)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise UnwritableFile(f'cannot make the folder {folder}: {error.strerror}') from error
    path = _free_name(folder, seen)
    write_capsule(path, seen)
    _leave(folder, path, most, most_bytes)
    return path


def _free_name(folder, seen):
    said = seen.refinement.result.assessment if seen.refinement else None
    if seen.refinement is None:
        what = 'refused'
    else:
        what = seen.refinement.result.status.value if said is None else said.verdict.value
    stamp = max(seen.pair.stamp, 0)
    names = (f'idem_capsule_{stamp:020d}_{k:03d}_{what}.mcap' for k in range(1000))
    for name in names:
        if not (folder / name).exists():
            return folder / name
    raise UnwritableFile(f'{folder} holds a thousand capsules of the stamp {stamp}')


def _leave(folder, newest, most, most_bytes):
    ours = [path for path in folder.iterdir() if OURS.fullmatch(path.name)]
    known = [(path.stat(), path) for path in ours if path.is_file() and not path.is_symlink()]
    number, size = 1, newest.stat().st_size
    by_age = sorted(known, key=lambda each: (each[0].st_mtime_ns, each[1].name), reverse=True)
    for stat, path in by_age:
        if path == newest:
            continue
        number, size = number + 1, size + stat.st_size
        if number > most or size > most_bytes:
            path.unlink(missing_ok=True)
