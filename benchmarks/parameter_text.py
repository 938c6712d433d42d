"""config/refine.yaml: every parameter of the node with its default and what it is."""

from dataclasses import fields
from textwrap import wrap

import yaml

from idem_ros.core.parameter import parameter_name
from idem_ros.node.interface import CONFIGS
from idem_ros.parameters.fields import default_of, description_of

HEAD = """\
# Every parameter of idem_node with its default, written by `make docs`. Use it with
#   ros2 launch idem_ros refine.launch.py params_file:=<a copy of this file>
#   ros2 run idem_ros idem_node --ros-args --params-file <a copy of this file>
# Each may be changed while the node runs (ros2 param set /idem_node a 1.5), or it says so.
/**:
  ros__parameters:
"""
WIDTH = 99


def parameter_text():
    """Return the file."""
    return HEAD + '\n'.join(_section(config_type) for config_type in CONFIGS)


def _section(config_type):
    title, *_ = config_type.__doc__.splitlines()
    lines = [f'    ## {title}']
    group = None
    for each in fields(config_type):
        *groups, name = parameter_name(each).split('.')
        indent = '    ' + '  ' * len(groups)
        if groups != [group] and groups:
            (group,) = groups
            lines.append(f'    {group}:')
        fixed = ' (fixed when the node starts)' if each.metadata.get('fixed') else ''
        lines += [
            f'{indent}# {line}'
            for line in wrap(description_of(each) + fixed, WIDTH - len(indent) - 2)
        ]
        lines.append(f'{indent}{name}: {_value(default_of(each))}')
    return '\n'.join(lines) + '\n'


def _value(value):
    text = yaml.safe_dump(value, default_flow_style=True, width=10**6)
    return text.removesuffix('\n...\n').strip()
