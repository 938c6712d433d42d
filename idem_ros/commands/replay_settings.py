"""The options of `idem replay` that decide what comes out of it."""

from argparse import SUPPRESS, ArgumentTypeError

from idem_ros.commands.inputs import add_max_chunk, given_of
from idem_ros.commands.options import REPLAYED, add_config_options, config_from
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.replay.settings import IDEM, METHODS, SEQUENCES, Settings
from idem_ros.terminal.command_line import UsageError


def add_settings_options(parser):
    """Add the options; one that nobody gives is not in the namespace."""
    _add_methods(parser)
    _add_selection(parser)
    add_max_chunk(parser)
    parser.add_argument(
        '--sequence',
        choices=SEQUENCES,
        default=SUPPRESS,
        help='odometry over the scans of one topic, from the first on: each against the one '
        'before, or against the last ten; --tum is the trajectory',
    )
    parser.add_argument(
        '--params',
        metavar='FILE',
        default=SUPPRESS,
        help="parameters as the node reads them (YAML, /**: ros__parameters:); the command line's "
        'own options win',
    )
    for config_type in REPLAYED:
        add_config_options(parser, config_type=config_type)


def _add_methods(parser):
    parser.add_argument(
        '--method',
        metavar='NAME',
        type=_methods,
        action='extend',
        default=SUPPRESS,
        help=f'what registers: {", ".join(METHODS)}; several, by commas or by giving the option '
        'again, refine the same pairs (default: idem; the others need the extra bench)',
    )
    parser.add_argument(
        '--max-distance',
        metavar='M',
        type=float,
        default=SUPPRESS,
        help='how far the methods of small_gicp look for a correspondence, and the edge of the '
        "voxels of vgicp (default: 3 times the target's mean distance to the fourth neighbour)",
    )


def _add_selection(parser):
    for name, kind, what in (
        ('start', float, 'refine sources from here on, after the beginning of the recording [s]'),
        ('duration', float, 'refine sources for so long (default: to the end) [s]'),
        ('every', int, 'refine every n-th of these sources (default: 1)'),
    ):
        metavar = 'N' if kind is int else 'S'
        parser.add_argument(f'--{name}', metavar=metavar, type=kind, default=SUPPRESS, help=what)


def settings_from(args, then=None):
    """Return ([`Settings`] of each method, [notes on what was let pass]).

    Args:
        args: the namespace.
        then: `Settings` that hold where nothing else is given; None: the defaults.

    Raises:
        UsageError: a value out of range, values that contradict each other, a file of parameters
            that is none.
    """
    bases = {} if then is None else {type(each): each for each in vars(then).values()}
    notes = []
    if hasattr(args, 'params'):
        of_file, notes = _read(args.params)
        bases |= of_file
    configs = [config_from(args, kind, bases.get(kind)) for kind in REPLAYED]
    others = given_of(args, 'max_distance', 'start', 'duration', 'every', 'sequence', 'max_chunk')
    if 'sequence' in others and any(getattr(config, 'mode', '') == 'audit' for config in configs):
        raise UsageError('--sequence has no poses to judge, which mode audit does; choose one')
    methods = dict.fromkeys(getattr(args, 'method', [IDEM]))
    try:
        return [Settings(*configs, method=method, **others) for method in methods], notes
    except InvalidConfig as error:
        raise UsageError(str(error)) from error


def _read(file):
    from idem_ros.node.interface import CONFIGS
    from idem_ros.parameters.parameter_file import BadParameterFile, configs_of, read_parameters

    live = [kind for kind in CONFIGS if kind not in REPLAYED]
    try:
        parameters, others = read_parameters(file)
        configs, passed = configs_of(file, parameters, REPLAYED, elsewhere=live)
    except BadParameterFile as error:
        raise UsageError(str(error)) from error
    except InvalidConfig as error:
        raise UsageError(f'{file}: {error}') from error
    notes = []
    if passed:
        notes.append(f'{file}: {", ".join(passed)} let pass, of a live node only')
    if others:
        notes.append(f'{file}: what it says to {", ".join(others)} is not for this node')
    return configs, notes


def _methods(text):
    methods = [word.strip().lower() for word in text.split(',')]
    for method in methods:
        if method not in METHODS:
            raise ArgumentTypeError(f'{method!r} is none of {", ".join(METHODS)}')
    return methods
