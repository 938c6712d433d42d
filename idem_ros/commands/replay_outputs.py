"""The files that `idem replay` writes: checked before the work, written after it."""

from pathlib import Path

from idem_ros.commands.exit_codes import UsageError


def check_outputs(args):
    """Refuse before the work what could not be written after it."""
    from idem_ros.atomic_file import require_writable

    outputs = [file for file in (args.json, args.out, args.tum) if file and file != '-']
    if args.out and not args.out.endswith('.mcap'):
        raise UsageError(f'--out is {args.out}; its name must end in .mcap')
    bag, *resolved = (Path(file).resolve() for file in [args.bag, *outputs])
    if len({bag, *resolved}) <= len(outputs) or any(bag in file.parents for file in resolved):
        raise UsageError(
            f'among {", ".join([args.bag, *outputs])} a file is named twice; '
            'each output needs a file of its own outside the recording'
        )
    for file in outputs:
        require_writable(file)


def write_outputs(args, replayed, settings, input_):
    """Write what was asked for.

    Args:
        args: with `json`, `out` and `tum`.
        replayed: `Replay`.
        settings: `Settings` that it was made with.
        input_: the recording's `fingerprint`; None where neither JSON nor MCAP is asked for.
    """
    import json

    from idem_ros.evaluation.provenance import as_metadata, made_by
    from idem_ros.evaluation.summary import json_record
    from idem_ros.recording.results import write_result

    if args.tum:
        _write_tum(args.tum, replayed)
    if not (args.json or args.out):
        return
    made = made_by(settings, replayed.topics, input_)
    text = json.dumps(json_record(replayed, made), indent=1, allow_nan=False) + '\n'
    if args.out:
        write_result(args.out, replayed.frames, as_metadata(made), text.encode())
    if args.json:
        _write_text(args.json, text)


def _write_tum(file, replayed):
    from idem_ros.pose_files import write_tum

    refinements = [frame.refinement for frame in replayed.frames]
    write_tum(
        file,
        [refinement.stamp for refinement in refinements],
        [refinement.result.T_target_source for refinement in refinements],
    )


def _write_text(file, text):
    from idem_ros.atomic_file import replacing

    if file == '-':
        print(text, end='')
        return
    with replacing(file) as temporary:
        temporary.write_text(text)
