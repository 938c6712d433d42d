"""The files of a recording, by metadata.yaml and by name; where recordings lie; checksums."""

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from idem_ros.core.exceptions import IdemError
from idem_ros.files.structured_text import UnreadableText, read_yaml

KINDS = ('.mcap', '.db3', '.bag')
COMPRESSED = ('.zstd', '.zst', '.lz4')
SUFFIXES = (*KINDS, *(kind + each for kind in KINDS for each in COMPRESSED))
METADATA = 'metadata.yaml'
MOST_BYTES, MOST_VALUES = 2**22, 500_000  # of a metadata.yaml: hundreds of topics and files

SHOWN = 3  # names in a message

BLOCK = 2**20


class UnreadableRecording(IdemError):
    """A recording of which nothing can be read."""


@dataclass(frozen=True)
class Contents:
    """What a folder should hold, and what it does."""

    files: tuple[Path, ...]
    """That are there, in the order of their names."""
    missing: tuple[tuple[str, int | None], ...] = ()
    """Names in metadata.yaml of files that are not there, with their numbers of messages."""
    extra: tuple[str, ...] = ()
    """Files that metadata.yaml does not name, and that are read."""
    left_out: tuple[str, ...] = ()
    """Files that it does not name, and that are not read."""
    messages: int | None = None
    """How many there should be; None: nothing says so."""
    damage: str = ''
    """Why metadata.yaml is not believed."""


def recording_files(path):
    """Return the files of a recording: itself, or those of its folder, by name.

    Raises:
        UnreadableRecording: there is none.
    """
    return list(contents_of(path).files)


def contents_of(path):
    """Return the `Contents` of a recording.

    Raises:
        UnreadableRecording: there is no such path, or no recording.
    """
    path = Path(path)
    if not path.exists():
        raise UnreadableRecording(f'{path} does not exist; give a recording ({_suffixes()})')
    if not path.is_dir():
        if not path.is_file():
            raise UnreadableRecording(f'{path} is no file; give a recording ({_suffixes()})')
        if not path.name.endswith(SUFFIXES):
            raise UnreadableRecording(
                f'{path} is no recording: its suffix must be {_suffixes()}{_from_clouds(path)}'
            )
        return Contents((path,))
    there = sorted(each for each in path.iterdir() if is_recording(each.name) and each.is_file())
    is_described = (path / METADATA).is_file()
    if not there:
        but = f', but a {METADATA}: the files that it names are elsewhere' if is_described else ''
        raise UnreadableRecording(
            f'the folder {path} holds no recording ({_suffixes()}){but}{_from_clouds(path)}'
        )
    if not is_described:
        _require_one(path, there)
        return Contents(_each_once(there))
    try:
        named, messages = _metadata(path / METADATA)
    except UnreadableText as error:
        return Contents(_each_once(there), damage=str(error)[:300])
    except (ValueError, TypeError, LookupError, AttributeError) as error:
        reason = f'{path / METADATA} is none of rosbag2: {type(error).__name__}: {error}'
        return Contents(_each_once(there), damage=reason[:300])
    return _matched(path, there, named, messages)


def is_recording(name):
    """Return whether a file's name is that of a recording, and not hidden."""
    return name.endswith(SUFFIXES) and not name.startswith('.')


def _require_one(path, files):
    """Of files that no metadata.yaml makes one recording, parts of one differ in numbers only."""
    stems = {re.sub(r'\d+', '', bare_name(file.name).rpartition('.')[0]) for file in files}
    if len(stems) > 1:
        names = ', '.join(file.name for file in files[:SHOWN])
        more = f' and {len(files) - SHOWN} more' if len(files) > SHOWN else ''
        raise UnreadableRecording(
            f'the folder {path} holds several recordings ({names}{more}), and no {METADATA} makes '
            f'them one; name one, or take each by itself: idem evaluate {path}'
        )


def _suffixes():
    return ', '.join(KINDS)


def _from_clouds(path):
    """Return how a recording is made of what is a cloud, or a folder with clouds; else ''."""
    from idem_ros.files.cloud_file import READERS  # late: only who errs waits for its readers

    inside = [*path.glob('*'), *path.glob('velodyne/*')] if path.is_dir() else [path]
    if not any(each.suffix.lower() in READERS for each in inside):
        return ''
    clouds = 'FOLDER' if path.is_dir() else 'TARGET SOURCE'
    return f'; these are clouds, make one: idem bag {clouds} --out run.mcap'


def bare_name(name):
    """Return the name of a file without the suffix of its compression."""
    for suffix in COMPRESSED:
        name = name.removesuffix(suffix)
    return name


def _each_once(files):
    """Return files without those that are another one compressed."""
    names = {file.name for file in files}
    return tuple(f for f in files if bare_name(f.name) == f.name or bare_name(f.name) not in names)


def _matched(path, there, named, messages):
    files, missing = {}, []
    for name, count in named:
        # a folder that was compressed, or the other way round, by hand
        same = [file for file in there if bare_name(file.name) == bare_name(name)]
        same.sort(key=lambda file: (file.name != name, file.name))
        if same:
            files[same[0]] = count
        else:
            missing.append((name, count))
    if not files:
        _require_one(path, there)
    taken = {bare_name(file.name) for file in files}
    kinds = {Path(bare_name(name)).suffix for name, _ in named}
    others = [file for file in _each_once(there) if bare_name(file.name) not in taken]
    extra = [f for f in others if not files or Path(bare_name(f.name)).suffix in kinds]
    return Contents(
        tuple(sorted({*files, *extra})),
        tuple(missing),
        tuple(file.name for file in extra),
        tuple(file.name for file in others if file not in extra),
        messages,
    )


def _metadata(path):
    """Return ([(name, messages or None)] of its files, messages in all) of a metadata.yaml."""
    information = read_yaml(path, MOST_BYTES, MOST_VALUES)['rosbag2_bagfile_information']
    if not isinstance(information['relative_file_paths'], list):
        raise TypeError('its relative_file_paths are no list')
    names = [PurePosixPath(name).name for name in information['relative_file_paths']]
    counts = {
        PurePosixPath(each['path']).name: _count(each.get('message_count'))
        for each in information.get('files') or ()
    }
    total = _count(information.get('message_count'))
    return [(name, counts.get(name, counts.get(bare_name(name)))) for name in names], total


def _count(value):
    return value if type(value) is int and 0 <= value < 2**63 else None


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
    numbered = re.compile(rf'{re.escape(folder_name)}_\d+\.(mcap|db3)')
    return bool(files) and all(numbered.fullmatch(bare_name(name)) for name in files)


def fingerprint(path):
    """Return {'name', 'size' [bytes], 'sha256'} of a recording.

    A folder's checksum is that of the lines `sha256sum` would print of its recordings, in the
    order of their names.

    Raises:
        UnreadableRecording: there is no such recording.
    """
    return fingerprint_of(path, recording_files(Path(path)))


def fingerprint_of(path, files):
    """Return the same of a file, or of files that lie in a folder."""
    path = Path(path)
    sums = [_sha256(file) for file in files]
    if path.is_dir():
        lines = (f'{sum_}  {file.name}\n' for sum_, file in zip(sums, files, strict=True))
        sums = [hashlib.sha256(''.join(lines).encode()).hexdigest()]
    return {
        'name': path.resolve().name,
        'size': sum(file.stat().st_size for file in files),
        'sha256': sums[0],
    }


def _sha256(file):
    sum_ = hashlib.sha256()
    with file.open('rb') as stream:
        while block := stream.read(BLOCK):
            sum_.update(block)
    return sum_.hexdigest()
