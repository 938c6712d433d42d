from argparse import ArgumentError, ArgumentParser
from dataclasses import fields

import pytest

from idem_ros.commands.main import command_line, main
from idem_ros.commands.options import add_config_options, config_from, option_name
from idem_ros.core import RegistrationConfig
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.targets import PairingConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.terminal.command_line import UsageError


def parsed(*argv):
    parser = ArgumentParser()
    add_config_options(parser)
    return config_from(parser.parse_args(argv))


def test_without_options_the_configuration_is_the_default():
    assert parsed() == RegistrationConfig()


def test_every_field_has_an_option_with_its_description(capsys):
    parser = ArgumentParser()
    add_config_options(parser)
    text = ' '.join(parser.format_help().split())
    for field in fields(RegistrationConfig):
        assert option_name(field) in text
        assert field.metadata['description'] in text


def test_points_that_take_part_are_chosen_by_options_too():
    parser = ArgumentParser()
    add_config_options(parser, config_type=PreprocessingConfig)
    argv = ['--min-range', '0.5', '--crop-min=-5,-5,-1', '--crop-target', '--max-points', '900']
    assert config_from(parser.parse_args([]), PreprocessingConfig) == PreprocessingConfig()
    assert config_from(parser.parse_args(argv), PreprocessingConfig) == PreprocessingConfig(
        min_range=0.5, crop_min=(-5.0, -5.0, -1.0), crop_target=True, max_points=900
    )
    with pytest.raises(UsageError, match='max_points is 0'):
        config_from(parser.parse_args(['--max-points', '0']), PreprocessingConfig)


def test_guesses_and_pairing_are_chosen_by_options_too():
    parser = ArgumentParser()
    for config_type in (PairingConfig, GuessConfig):
        add_config_options(parser, config_type=config_type)
    args = parser.parse_args([])
    assert config_from(args, PairingConfig) == PairingConfig()
    assert config_from(args, GuessConfig) == GuessConfig()
    argv = ['--pairing', 'nearest', '--pairing-tolerance', '0.2']
    argv += ['--initial-guess-type', 'odometry', '--initial-guess-max-age', 'none']
    args = parser.parse_args([*argv, '--initial-guess-max-jump', '2'])
    assert config_from(args, PairingConfig) == PairingConfig('nearest', 0.2)
    assert config_from(args, GuessConfig) == GuessConfig('odometry', None, 2.0)
    with pytest.raises(UsageError, match='initial_guess.max_jump is 0.0'):
        config_from(parser.parse_args(['--initial-guess-max-jump', '0']), GuessConfig)


def test_options_reach_the_fields_of_their_names():
    config = parsed(
        *('--voxel-size', '0.5', '--a', '1.5', '--radius-schedule', '8,2,1'),
        *('--length-scale', 'none', '--max-iterations', '7'),
    )
    assert config == RegistrationConfig(
        voxel_size=0.5,
        a=1.5,
        radius_schedule=(8.0, 2.0, 1.0),
        length_scale='none',
        max_iterations=7,
    )


@pytest.mark.parametrize(
    'argv',
    [('--a', '0'), ('--voxel-size', '-1'), ('--a', 'nan'), ('--radius-schedule', '1,0')],
)
def test_a_value_out_of_range_is_a_usage_error_that_names_the_field(argv):
    with pytest.raises(UsageError, match=argv[0].strip('-').replace('-', '_')):
        parsed(*argv)


@pytest.mark.parametrize(
    'argv',
    [
        ('--a', 'x'),
        ('--max-iterations', '1.5'),
        ('--length-scale', 'm'),
        ('--radius-schedule', ''),
    ],
)
def test_a_value_that_is_no_such_thing_is_refused_by_the_parser(argv, capsys):
    with pytest.raises(SystemExit) as ended:
        parsed(*argv)
    assert ended.value.code == 2
    assert argv[0] in capsys.readouterr().err


@pytest.mark.parametrize('text', ['abc', '', '1,2'])
def test_what_is_neither_a_number_nor_none_is_named(capsys, text):
    with pytest.raises(SystemExit):
        parsed('--voxel-size', text)
    assert f'{text!r} is not a number, auto or none' in capsys.readouterr().err


def typed_options():
    (commands,) = (each.choices for each in command_line()._actions if each.choices)
    return [
        pytest.param(parser, action, id=f'{name} {action.dest}')
        for name, parser in commands.items()
        for action in parser._actions
        if action.type not in (None, str)
    ]


@pytest.mark.parametrize(('parser', 'action'), typed_options())
def test_a_value_of_another_kind_is_told_what_would_be_right(parser, action):
    with pytest.raises(ArgumentError) as refused:
        parser._get_value(action, ',')
    assert 'invalid' not in str(refused.value)  # as argparse says it: "invalid _seconds value"


def test_every_word_that_a_number_may_be_is_named(capsys):
    with pytest.raises(SystemExit):
        main(['replay', 'x.mcap', '--voxel-size', 'foo'])
    assert "'foo' is not a number, auto or none" in capsys.readouterr().err
