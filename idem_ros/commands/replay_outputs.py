"""The files that `idem replay` writes: checked before the work, written after it."""

from itertools import chain
from pathlib import Path
from tempfile import TemporaryFile
from typing import NamedTuple

from idem_ros.commands.output_names import require_ending, require_outputs
from idem_ros.terminal.command_line import UsageError


class Outputs(NamedTuple):
    """Where the result of one method goes; None: nowhere."""

    json: str | None
    """- for stdout."""
    out: str | None
    tum: str | None

    @property
    def files(self):
        """The files among them, [(option, file)]."""
        named = self._asdict().items()
        return [(f'--{name}', file) for name, file in named if file and file != '-']


def outputs_for(args, inputs, methods):
    """Return the `Outputs` of each method, refusing early what could not be written later.

    Args:
        args: with `json`, `out`, `clouds` and `tum`.
        inputs: files and folders that no output may replace or lie in.
        methods: one, whose files are named as given, or several, each of which has files of its
            own: result.json becomes result.gicp.json.

    Raises:
        UsageError: a name that does not do, see `require_outputs`.
        UnwritableFile: a place where nothing can be written.
    """
    if args.out:
        require_ending('--out', args.out, ['.mcap'])
    if args.clouds and not args.out:
        raise UsageError('--clouds is for --out; name the recording that they go into')
    given = Outputs(args.json, args.out, args.tum)
    several = len(methods) > 1
    if several and given.json == '-':
        raise UsageError(f'--json is -, but {len(methods)} methods need a file each; name one')
    each = [_of_method(given, method) if several else given for method in methods]
    require_outputs(args, [named for outputs in each for named in outputs.files], inputs)
    return each


def write_outputs(outputs, replayed, settings, made_of, with_clouds=False):
    """Write what was asked for.

    Args:
        outputs: `Outputs`.
        replayed: `Replay`.
        settings: `Settings` that it was made with.
        made_of: `fingerprint`s of recording and map, see `provenance.made_by`; where neither JSON
            nor MCAP is asked for they are not looked at.
        with_clouds: whether the MCAP holds the clouds, too.
    """
    from idem_ros.recording.results import write_result
    from idem_ros.replay.clouds_again import recorded_clouds
    from idem_ros.replay.provenance import as_metadata, made_by
    from idem_ros.results.result_file import record_text
    from idem_ros.results.summary import json_record

    if outputs.tum:
        _write_tum(outputs.tum, replayed)
    if not (outputs.json or outputs.out):
        return
    made = made_by(settings, replayed.topics, *made_of)
    with TemporaryFile() as text:
        text.writelines(map(str.encode, record_text(json_record(replayed, made))))
        if outputs.out:
            clouds = recorded_clouds(replayed) if with_clouds else ()
            write_result(outputs.out, replayed.frames, as_metadata(made), text, clouds)
        if outputs.json:
            _copy(text, outputs.json)


def _of_method(given, method):
    def named(file):
        return file and str(Path(file).with_suffix(f'.{method}{Path(file).suffix}'))

    return Outputs(*map(named, given))


def _write_tum(file, replayed):
    import numpy as np

    from idem_ros.files.pose_file import write_tum

    def refinements():
        return (frame.refinement for frame in replayed.frames)

    stamps = (each.instant for each in refinements())
    poses = (each.result.T_target_source for each in refinements())
    if replayed.sequence:
        stamps = chain([replayed.sequence.first_stamp], stamps)
        poses = chain([np.eye(4)], poses)
    write_tum(file, stamps, poses)


def _copy(text, file):
    import shutil
    import sys

    from idem_ros.files.atomic_file import replacing

    text.seek(0)
    if file == '-':
        sys.stdout.writelines(line.decode() for line in text)
        return
    with replacing(file) as temporary, temporary.open('wb') as stream:
        shutil.copyfileobj(text, stream)
