"""The parameter files of the package, as the tests read them."""

import yaml


def parameters_in(file):
    """Return {name: value} of a file for every node, named as ROS names those of groups."""
    return dict(_flat(yaml.safe_load(file.read_text())['/**']['ros__parameters']))


def _flat(group, prefix=''):
    for name, value in group.items():
        if isinstance(value, dict):
            yield from _flat(value, f'{prefix}{name}.')
        else:
            yield prefix + name, value
