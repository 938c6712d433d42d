"""What tells one recording from another, wherever it lies: name, size, checksum."""

import hashlib
from pathlib import Path

from idem_ros.recording.folder import recording_files

BLOCK = 2**20


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
