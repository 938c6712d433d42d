"""Many cloud files, in memory that does not grow with their points but with their voxels."""

import hashlib
from pathlib import Path

import numpy as np

from idem_ros.core import Cloud
from idem_ros.core.config import AUTO
from idem_ros.core.exceptions import IdemError, InvalidCloud
from idem_ros.core.metric.voxel_size import common_voxel_size

MOST_KEPT = 20_000_000  # points as given, 500 MB; of more clouds the voxels alone are kept


class RepeatedCloud(IdemError):
    """One cloud given twice: it would count twice."""


def clouds_of_files(files, read, config):
    """Return a `Cloud` of each file, as given, or its voxels where they are too many together.

    Args:
        files: paths.
        read: read(file) returns (N, 3) points.
        config: `RegistrationConfig`.

    Returns:
        (clouds, voxel size that they stand for or None). Where the size is a number, all of the
        clouds have been reduced to it.

    Raises:
        RepeatedCloud: two files are one, or hold the same points.
        InvalidCloud: too many points that are to be registered as given.
    """
    refuse_same_files(files)
    seen, clouds, fits, total = {}, [], [], 0
    size = config.voxel_size
    for file in files:
        cloud = _cloud(read, file, seen)
        fits.append(cloud.voxel_fit() if size == AUTO else None)
        total += len(cloud)
        if total <= MOST_KEPT:
            clouds.append(cloud)
        elif size is None:
            raise InvalidCloud(
                f'the first {len(fits)} clouds have {total} points; give a voxel size, or fewer'
            )
        elif size == AUTO:
            clouds.append(None)
        else:
            clouds.append(cloud.reduced(size))
    if total <= MOST_KEPT:
        return clouds, None
    if size == AUTO:
        size = common_voxel_size(*fits)
        if size is None:
            raise InvalidCloud('no voxel size suits all clouds; give one, in their unit')
    for k, file in enumerate(files):
        cloud = clouds[k] or _cloud(read, file, {})
        clouds[k] = cloud if cloud.is_reduced else cloud.reduced(size)
    return clouds, size


def _cloud(read, file, seen):
    """Return the `Cloud` of a file; seen: digests of those before it, to which its is added."""
    points = read(file)
    refuse_copy(file, points, seen)
    try:
        return Cloud.for_one_call(points)
    except InvalidCloud as error:
        raise InvalidCloud(f'{file}: {error}') from error


def refuse_copy(file, points, seen):
    """Refuse points that a file before had in any order, of {digest: file}; it is added.

    Raises:
        RepeatedCloud: it says which.
    """
    digest = hashlib.blake2b(np.sort(points, axis=0).tobytes(), digest_size=16).digest()
    if digest in seen:
        raise RepeatedCloud(
            f'{file} holds the same points as {seen[digest]}: give each cloud once'
        )
    seen[digest] = file


def refuse_same_files(files):
    """Refuse one file under two names.

    Raises:
        RepeatedCloud: it says which.
    """
    seen = {}
    for file in files:
        path = Path(file).resolve()
        if path in seen:
            raise RepeatedCloud(f'{file} is given twice: give each cloud once')
        seen[path] = file
