"""The fields of `RegistrationConfig` as command line options, and back."""

from argparse import ArgumentTypeError
from dataclasses import fields

from idem_ros.commands.exit_codes import UsageError
from idem_ros.core.config import LENGTH_SCALES, RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig


def add_config_options(parser, without=()):
    """Add one option for each field, of the same name: voxel_size becomes --voxel-size.

    Args:
        parser: what they are added to.
        without: names of fields that the command decides itself.
    """
    group = parser.add_argument_group('registration')
    for field in fields(RegistrationConfig):
        if field.name in without:
            continue
        group.add_argument(
            option_name(field),
            dest=field.name,
            default=field.default,
            type=_parser_of(field),
            metavar=None if field.name == 'length_scale' else _metavar(field),
            choices=LENGTH_SCALES if field.name == 'length_scale' else None,
            help=f'{field.metadata["description"]} (default: {_shown(field.default)})',
        )


def config_from(args):
    """Build the `RegistrationConfig` that the options ask for.

    Raises:
        UsageError: a value outside its range.
    """
    names = [field.name for field in fields(RegistrationConfig) if hasattr(args, field.name)]
    try:
        return RegistrationConfig(**{name: getattr(args, name) for name in names})
    except InvalidConfig as error:
        raise UsageError(str(error)) from error


def option_name(field):
    """Return the option of a field."""
    return '--' + field.name.replace('_', '-')


def _parser_of(field):
    """Return what turns an option's text into a value of the field's type."""
    if isinstance(field.default, tuple):
        return _numbers
    return float if field.default is None else type(field.default)


def _numbers(text):
    try:
        return tuple(float(part) for part in text.split(','))
    except ValueError as error:
        raise ArgumentTypeError(f'{text!r} is no list of numbers such as 4,2,1') from error


def _metavar(field):
    if isinstance(field.default, tuple):
        return 'X,Y,...'
    return field.metadata['unit'].upper() or ('N' if isinstance(field.default, int) else 'X')


def _shown(default):
    if isinstance(default, tuple):
        return ','.join(f'{number:g}' for number in default)
    return 'none' if default is None else default
