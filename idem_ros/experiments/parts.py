"""What an interrupted experiment has done, case by case, and need not do again."""

import json

from idem_ros.files.atomic_file import replacing


def write_part(path, made_with, record):
    """Write a record (JSON), with the settings that it was made with."""
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(json.dumps({'made_with': made_with, 'record': record}) + '\n')


def read_part(path, made_with):
    """Return the record that a run of the same settings left; None if there is none."""
    try:
        part = json.loads(path.read_text())
        return part['record'] if part['made_with'] == made_with else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
