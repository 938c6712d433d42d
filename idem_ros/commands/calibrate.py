"""`idem calibrate`: where the LiDARs of one rig are, from clouds or from a recording."""

from pathlib import Path
from typing import Any, NamedTuple

from idem_ros.calibration.config import DECIDED
from idem_ros.commands.inputs import (
    CLOUD_KINDS,
    add_columns_option,
    add_max_chunk,
    opened,
    points_of_file,
)
from idem_ros.commands.options import OF_PAIRS, add_config_options, config_from
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.terminal.command_line import FAILED, OK, UsageError

INSTANTS = 5


class Read(NamedTuple):
    """What there is to calibrate."""

    names: Any
    """Of the sensors, the reference first."""
    sightings: Any
    tree: Any = None
    """Of tf_static; None: there is none."""
    notes: Any = ()
    """What was left out, a line each."""
    are_all_heard: bool = True
    truth: Any = {}
    """{name: (4, 4)} of sensors in the frame of the reference, where it is known."""
    strides: Any = None
    """strides(twists) yields `Stride`s, given the reference's twists at the sightings."""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'calibrate',
        help='find where the LiDARs of one rig are',
        description='Find the pose of each LiDAR of a rig in the frame of the first, from starts '
        'that are up to 45 deg and 0.5 m off. The exit code is 0 where every sensor is aligned, '
        'else 1.',
    )
    _add_inputs(parser)
    parser.add_argument(
        '--out',
        metavar='FOLDER',
        help='make a folder of the extrinsics as YAML, as joints of a URDF and as '
        'static_transform_publisher lines, and a picture of the clouds before and after',
    )
    parser.add_argument('--json', action='store_true', help='print the result as JSON')
    add_columns_option(parser)
    add_max_chunk(parser)
    add_config_options(parser, without=DECIDED)
    add_config_options(parser, OF_PAIRS, PreprocessingConfig)
    add_config_options(parser, config_type=PointTimeConfig)
    parser.set_defaults(run=run)


def _add_inputs(parser):
    parser.add_argument(
        'input',
        metavar='CLOUDS',
        nargs='+',
        help=f'a recording with a topic a sensor; or a file a sensor ({CLOUD_KINDS}); or a folder '
        'an instant, each with a file a sensor, of the same names in all',
    )
    parser.add_argument(
        '--start',
        metavar='FILE',
        help='where the sensors are, about: a URDF, a YAML as --out writes it, or a pose a sensor '
        'in their order (default: /tf_static of the recording; else all at one place)',
    )
    parser.add_argument(
        '--reference',
        metavar='NAME',
        help="whose frame it is in: a recording's topic, a file's sensor (default: first)",
    )
    parser.add_argument(
        '--topics',
        metavar='NAME',
        nargs='+',
        help='topics of the sensors (default: all of PointCloud2)',
    )
    parser.add_argument(
        '--names',
        metavar='NAME',
        nargs='+',
        help='frames of the sensors, in the order of files or topics (default: the names of the '
        'files without suffix; the frame_id of the clouds)',
    )
    parser.add_argument(
        '--instants',
        metavar='N',
        type=int,
        default=INSTANTS,
        help='instants of a recording, spread evenly over it (default: %(default)s)',
    )


def run(args):
    """Calibrate, print and write."""
    from idem_ros.calibration.hand_eye import with_motion
    from idem_ros.calibration.initial_extrinsics import no_starts, read_starts, starts_of
    from idem_ros.calibration.result_files import beside_truth, moved, write_calibration
    from idem_ros.calibration.rig_calibration import Uncalibrated
    from idem_ros.calibration.synchronized_scans import calibrate_sightings
    from idem_ros.commands.calibration_lines import record_text, text
    from idem_ros.files.atomic_file import require_free

    config = config_from(args)
    if args.instants < 1:
        raise UsageError(f'--instants is {args.instants}; it must be from 1')
    if args.out:
        require_free(args.out)
    read = (_recorded if _is_recording(args) else _filed)(args)
    names, notes = read.names, list(read.notes)
    tree = read_starts(args.start, names) if args.start else read.tree
    if tree is None:
        tree = no_starts(names)
        notes.append('no --start: the sensors are looked for from one place')
    starts = starts_of(tree, names)
    try:
        found, twists = calibrate_sightings(read.sightings, names, starts, config)
    except Uncalibrated as error:
        remedy = () if read.notes else ('name another by --reference',)
        raise Uncalibrated('; '.join([*read.notes, str(error), *remedy])) from error
    if not found.is_usable:
        found, said = with_motion(found, names, read.strides(list(twists.values())), config)
        notes += said
    if lacking := len(read.sightings) - len(found.instants):
        notes.append(f'{lacking} of {len(twists)} instants lack the reference, or all others')
    notes += [*moved(names, found, tree), *beside_truth(names, found, read.truth)]
    if args.out:
        write_calibration(args.out, names, found, tree)
    said = record_text if args.json else text
    print(said((names, found, tree), twists, notes, args.out))
    return OK if found.is_usable and read.are_all_heard else FAILED


def _is_recording(args):
    from idem_ros.recording.folder import METADATA, is_recording

    paths = [Path(each) for each in args.input]
    found = [
        each
        for each in paths
        if is_recording(each.name)
        or (each / METADATA).is_file()
        or (each.is_dir() and any(is_recording(inside.name) for inside in each.iterdir()))
    ]
    if found and len(paths) > 1:
        raise UsageError(f'{found[0]} is a recording: give it alone')
    if args.topics and not found:
        raise UsageError('--topics are of a recording, and none is given')
    return bool(found)


def _filed(args):
    """Return what there is to `Read` in files."""
    from idem_ros.calibration.file_sightings import files_of, sightings_of
    from idem_ros.calibration.relative_motions import strides_between

    preprocessing = config_from(args, PreprocessingConfig)

    def read(file):
        """Return the points of a file that take part."""
        return points_of_file(file, args.columns, preprocessing)[0]

    found, files = files_of(args.input)
    named = dict(zip(found, _named(args, found), strict=True))
    found = _reference_first(args, found, named)
    sightings, flaws = sightings_of(found, files, read)
    names = [named[each] for each in found]
    return Read(names, sightings, notes=flaws, strides=lambda twists: strides_between(sightings))


def _recorded(args):
    """Return what there is to `Read` in a recording."""
    from idem_ros.calibration.recorded_sightings import (
        cloud_topics,
        lateness,
        recorded_rig,
        sightings_in,
    )
    from idem_ros.calibration.relative_motions import strides_in
    from idem_ros.calibration.sighting_messages import preparing

    prepare = preparing(config_from(args, PreprocessingConfig))
    reading = config_from(args, PointTimeConfig), prepare
    with opened(args.input[0], args) as recording:
        given = args.topics
        topics = cloud_topics(recording, given, None)
        names = _named(args, topics) if args.names else None
        first = cloud_topics(recording, given, _topic_of(args, topics, names))
        rig = recorded_rig(recording, first)
        if names is not None:
            rig.names = [names[topics.index(each)] for each in rig.topics]
        sightings = sightings_in(recording, rig, args.instants, *reading)
        if len(sightings) < args.instants:
            rig.flaws.append(
                f'{args.instants} instants are asked for, and there are {len(sightings)}: so many '
                'clouds of the reference are followed by another'
            )
        silent = [f'{topic} is silent, and is left out' for topic in rig.silent]
        notes = [*recording.warnings, *silent, *rig.flaws, *lateness(rig, sightings)]

    def strides(twists):
        """Yield the strides of the recording, which is read once more."""
        with opened(args.input[0], args) as recording:
            yield from strides_in(recording, rig, args.instants, twists, reading)

    found = rig.names, sightings, rig.tree, notes
    return Read(*found, are_all_heard=not rig.silent, truth=rig.truth_of(), strides=strides)


def _named(args, found):
    names = args.names or found
    if len(names) != len(found) or len(set(names)) < len(names):
        raise UsageError(
            f'--names are {" ".join(names)}; there must be one each for {", ".join(found)}, in '
            'this order'
        )
    return names


def _topic_of(args, topics, names):
    """Return the topic that --reference means, by itself or by the name of its sensor."""
    if args.reference and names and args.reference in names:
        return topics[names.index(args.reference)]
    return args.reference


def _reference_first(args, found, named):
    if args.reference is None:
        return found
    first = [each for each in found if args.reference in (each, named[each])]
    if not first:
        raise UsageError(f'--reference is {args.reference}; there are {", ".join(named.values())}')
    return [*first, *(each for each in found if each not in first)]
