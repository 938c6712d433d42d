"""Arguments that ROS ignores without a word: parameter files of other nodes, misspelt topics."""

from contextlib import suppress
from difflib import get_close_matches
from itertools import pairwise

from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node

from idem_ros.core import IdemError
from idem_ros.node.interface import (
    IMU_INPUTS,
    INPUTS,
    OUTPUTS,
    POSE_INPUTS,
    SERVICES,
    TF_INPUTS,
)
from idem_ros.parameters.parameter_file import read_sections, speaks_to

OURS = INPUTS, POSE_INPUTS, TF_INPUTS, IMU_INPUTS, OUTPUTS, SERVICES
NAMES = [topic.name for topics in OURS for topic in topics.values()]


def warn_of_ignored(node: Node, args: list[str]) -> None:
    """Warn of parameter files that speak to other nodes only, and of names that nothing bears.

    Args:
        node: was started with them.
        args: of its process.
    """
    for option, given in pairwise(args):
        said = ''
        if option == '--params-file':
            said = _spoken_to_others(given, node.get_fully_qualified_name())
        elif option in ('-r', '--remap'):
            said = _borne_by_nothing(given, node.get_name(), node.get_namespace())
        if said:
            node.get_logger().warning(said)


def _spoken_to_others(path: str, this: str) -> str:
    with suppress(IdemError):  # ROS took it: it is for it to judge
        names = [name for name, _ in read_sections(path)]
        if not any(speaks_to(name, this) for name in names):
            spoken = ', '.join(names) or 'nobody'
            return f'{path} speaks to {spoken}; this is {this}: nothing of it is taken'
    return ''


def _borne_by_nothing(rule: str, name: str, namespace: str) -> str:
    """Say which of our names is meant by a rule that is for none; empty where none is like it."""
    remapped, _, new = rule.partition(':=')
    if remapped.startswith('__') or ':' in remapped:
        return ''
    last = {each.rpartition('/')[2]: each for each in NAMES}
    close = get_close_matches(remapped.rpartition('/')[2], last, 1)
    known = {expand_topic_name(each, name, namespace) for each in NAMES}
    if not close or expand_topic_name(remapped, name, namespace) in known:
        return ''
    return (
        f'nothing of this node is called {remapped}: the rule {rule} does nothing; '
        f'{last[close[0]]}:={new} is meant?'
    )
