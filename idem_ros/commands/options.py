"""The fields of the configurations as command line options, and back."""

import os
import re
from argparse import SUPPRESS, ArgumentTypeError
from dataclasses import fields, replace
from typing import Any

from idem_ros.core.config import LENGTH_SCALES, RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.parameter import is_optional, is_whole, parameter_name
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.map_target import MapConfig
from idem_ros.pairing.targets import PairingConfig
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.smoothing.config import SmoothingConfig
from idem_ros.terminal.command_line import WANTED, UsageError

TITLES = {
    RegistrationConfig: 'registration',
    PreprocessingConfig: 'points that take part',
    PairingConfig: 'pairing of clouds by their stamps',
    GuessConfig: 'initial guesses',
    PointTimeConfig: 'times of points within a sweep',
    MapConfig: 'target that is a map',
    SmoothingConfig: 'what is joined',
}
OF_PAIRS = ('crop_target',)  # of `PreprocessingConfig`: where no cloud is a target it says nothing
REPLAYED = tuple(kind for kind in TITLES if kind is not SmoothingConfig)


def add_config_options(parser, without=(), config_type: Any = RegistrationConfig, choices=None):
    """Add one option for each field, of the parameter's name: voxel_size becomes --voxel-size.

    Args:
        parser: what they are added to.
        without: names of fields that the command decides itself.
        config_type: whose fields; `config_from` takes the same.
        choices: {name of a field: words}, where the command takes fewer than there are.
    """
    # argparse takes "-1,-1,-1" for an option, as it does all that looks like no single number
    parser._negative_number_matcher = re.compile(r'-(\d|\.\d|inf)')
    group = parser.add_argument_group(TITLES[config_type])
    for field in fields(config_type):
        if field.name in without:
            continue
        shown = f'{field.metadata["description"]} (default: {_shown(field.default)})'
        # what nobody gives is left out: it may come from a file of parameters
        option = {'dest': _dest(field), 'default': SUPPRESS, 'help': shown}
        if isinstance(field.default, bool):
            group.add_argument(option_name(field), action='store_true', **option)
            continue
        words = LENGTH_SCALES if field.name == 'length_scale' else field.metadata.get('choices')
        words = (choices or {}).get(field.name, words)
        group.add_argument(
            option_name(field),
            type=_parser_of(field),
            metavar=None if words else _metavar(field),
            choices=words,
            **option,
        )


def config_from(args, config_type: Any = RegistrationConfig, base=None) -> Any:
    """Build the configuration that the options ask for.

    Args:
        args: the namespace.
        config_type: as `add_config_options` took it.
        base: what holds where no option is given; None: the defaults.

    Raises:
        UsageError: a value outside its range.
    """
    given = {
        field.name: getattr(args, _dest(field))
        for field in fields(config_type)
        if hasattr(args, _dest(field))
    }
    try:
        return replace(config_type() if base is None else base, **given)
    except InvalidConfig as error:
        raise UsageError(str(error)) from error


def option_name(field):
    """Return the option of a field."""
    return '--' + _dest(field).replace('_', '-')


def _dest(field):
    return parameter_name(field).replace('.', '_')


def _parser_of(field):
    """Return what turns an option's text into a value of the field's type."""
    if isinstance(field.default, tuple):
        return _numbers
    kind = int if is_whole(field) else type(field.default)
    if is_optional(field) and kind is not int:
        kind = float
    words = {word: word for word in field.metadata.get('words', ())}
    if is_optional(field):
        words['none'] = None
    return _number_or_word(kind, words) if words else kind


def _number_or_word(kind, words):
    """Return what reads a number of a kind, or one of {word: what it stands for}."""

    def read(text):
        try:
            return words[text] if text in words else kind(text)
        except ValueError as error:
            wanted = ', '.join([f'a {WANTED[kind]}', *list(words)[:-1]])
            raise ArgumentTypeError(f'{text!r} is not {wanted} or {list(words)[-1]}') from error

    return read


def _numbers(text):
    try:
        return tuple(float(part) for part in text.split(','))
    except ValueError as error:
        raise ArgumentTypeError(f'{text!r} is no list of numbers such as 4,2,1') from error


def _metavar(field):
    if isinstance(field.default, tuple):
        return 'X,Y,...'
    return field.metadata['unit'].upper() or ('N' if is_whole(field) else 'X')


def _shown(default):
    if isinstance(default, tuple):
        return ','.join(f'{number:g}' for number in default)
    if isinstance(default, bool):
        return 'no'
    return 'none' if default is None else default


def add_worker_options(parser, shared):
    """Add `--jobs` and `--cluster`: who does the work; shared: what workers elsewhere must see."""
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument(
        '--jobs', type=int, metavar='N', help='worker processes (default: one a core)'
    )
    workers.add_argument(
        '--cluster',
        metavar='ADDRESS',
        help='let the workers of a Dask scheduler (HOST:PORT) do it; they must see '
        f'{shared} (needs the extra "cluster")',
    )


def workers_from(args):
    """Return what does tasks, see `in_processes`; who watches them sees none of a cluster.

    Raises:
        UsageError: no number of processes.
    """
    if args.jobs is not None and args.jobs < 1:
        raise UsageError(f'--jobs is {args.jobs}; it must be from 1')
    if args.cluster is None:
        from idem_ros.evaluation.worker_processes import in_processes

        return lambda tasks, **how: in_processes(tasks, args.jobs or os.cpu_count(), **how)
    from idem_ros.evaluation.cluster import on_cluster

    return lambda tasks, watch=None, **how: on_cluster(tasks, args.cluster, **how)
