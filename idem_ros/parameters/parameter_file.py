"""A node's parameter file, read without ROS: YAML of nodes and their ros__parameters."""

import re
from dataclasses import fields

from idem_ros.core.exceptions import IdemError
from idem_ros.core.parameter import parameter_name
from idem_ros.files.structured_text import UnreadableText, read_yaml
from idem_ros.parameters.fields import is_real, value_of

NODE = 'idem_node'
WILDCARDS = {'*': '/[^/]+', '**': '(/[^/]+)*'}
PARAMETERS = 'ros__parameters'
OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service', 'qos_overrides')
EXPECTED = f'it must hold parameters as config/refine.yaml does: /**: {PARAMETERS}: name: value'


class BadParameterFile(IdemError):
    """A parameter file that cannot be read, or that says what no parameter is."""


def read_parameters(path):
    """Read what a file says to the node `idem_node`, in any namespace, or to every node.

    Returns:
        ({name: value}, [sections for other nodes]); nested names are joined by dots.

    Raises:
        BadParameterFile: it is no such file, or has nothing to say to this node.
    """
    sections = read_sections(path)
    others = [node for node, _ in sections if not _is_ours(node)]
    ours = [(node, section) for node, section in sections if _is_ours(node)]
    if not ours:
        raise BadParameterFile(f'{path} speaks to {", ".join(others) or "nobody"}; {EXPECTED}')
    parameters = {}
    for node, section in ours:
        if not (isinstance(section, dict) and isinstance(section.get(PARAMETERS), dict)):
            raise BadParameterFile(f'{path}: {node} has no {PARAMETERS}; {EXPECTED}')
        parameters.update(_flat(section[PARAMETERS]))
    for name, value in parameters.items():
        if isinstance(value, list) and any(isinstance(each, list | dict) for each in value):
            raise BadParameterFile(
                f'{path}: {name} is a list of lists; it must be one value, or a list of values'
            )
    return parameters, others


def read_sections(path):
    """Read which nodes a file speaks to, and what it says to each.

    Namespaces may be written out, as in `/robot/idem_node:`, or nest, as in `/robot: idem_node:`.

    Returns:
        [(name of a node, with wildcards, and its section)], in the order of the file.

    Raises:
        BadParameterFile: it is no such file.
    """
    try:
        content = read_yaml(path)
    except UnreadableText as error:
        raise BadParameterFile(str(error)) from error
    if not isinstance(content, dict):
        raise BadParameterFile(f'{path} holds no node; {EXPECTED}')
    return list(_sections(content))


def speaks_to(name, node):
    """Return whether a name of a parameter file means a node, given by its full name."""
    words = name.strip('/').split('/')
    pattern = ''.join(WILDCARDS.get(word) or f'/{re.escape(word)}' for word in words)
    return re.fullmatch(pattern, node) is not None


def configs_of(path, parameters, config_types, elsewhere=()):
    """Build configurations from the parameters of a file; what it does not name is as by default.

    Args:
        path: the file, for messages.
        parameters: {name: value}, of `read_parameters`.
        config_types: the configurations to build.
        elsewhere: configurations whose parameters are let pass: a live node has them only.

    Returns:
        ({type: configuration}, [names that were let pass])

    Raises:
        BadParameterFile: a name that is none, as a typing error makes it.
        InvalidConfig: a value out of range.
    """
    known = {parameter_name(each): each for kind in config_types for each in fields(kind)}
    live = [parameter_name(each) for kind in elsewhere for each in fields(kind)]
    passed = [name for name in parameters if name in live or name.split('.')[0] in OF_EVERY_NODE]
    unknown = [name for name in parameters if name not in known and name not in passed]
    if unknown:
        raise BadParameterFile(
            f'{path} sets {", ".join(unknown)}, which no parameter is; there are '
            f'{", ".join([*known, *live])}'
        )
    values = {
        name: value_of(each, _number(each, parameters[name]))
        for name, each in known.items()
        if name in parameters
    }
    return {kind: _built(kind, values) for kind in config_types}, passed


def _built(kind, values):
    names = {each.name: parameter_name(each) for each in fields(kind)}
    return kind(**{field: values[name] for field, name in names.items() if name in values})


def _sections(content, namespace=''):
    for name, section in content.items():
        node = f'{namespace.rstrip("/")}/{name.lstrip("/")}' if namespace else name
        is_namespace = isinstance(section, dict) and PARAMETERS not in section
        if is_namespace and section and all(isinstance(each, dict) for each in section.values()):
            yield from _sections(section, node)
        else:
            yield node, section


def _is_ours(node):
    return node.rpartition('/')[2] in (NODE, *WILDCARDS)


def _flat(parameters, prefix=''):
    flat = {}
    for name, value in parameters.items():
        if isinstance(value, dict):
            flat.update(_flat(value, f'{prefix}{name}.'))
        else:
            flat[f'{prefix}{name}'] = value
    return flat


def _number(field, value):
    """Return 1e-5 as the number it is for ROS: for YAML 1.1 it is a word, without its point."""
    if not (isinstance(value, str) and is_real(field)):
        return value
    try:
        return float(value)
    except ValueError:
        return value
