"""Why a node waits, of what no input tells."""

from typing import Any

from rclpy.node import Node

from idem_ros.node.interface import POSE_INPUTS
from idem_ros.pairing.guesses import FOLLOWING


def unheard_click(node: Node, guess_type: str) -> str:
    """Say that a pose is published by hand which a type of guess does not listen to, or ''.

    guess_type: '' of no guess that is waited for.
    """
    if guess_type in ('', *FOLLOWING):
        return ''
    topic = node.resolve_topic_name(POSE_INPUTS['initial_pose'].name)
    is_published = node.count_publishers(topic) > 0
    unheard = f'{topic} is published, which initial_guess.type initial_pose would listen to'
    return unheard if is_published else ''


def why_time_stands_still(node: Node) -> str:
    """Say that the node's clock waits for /clock, or ''."""
    clock: Any = node.get_clock()  # a ROSClock
    stands = clock.ros_time_is_active and clock.now().nanoseconds == 0
    return 'use_sim_time is true, and /clock has not come' if stands else ''
