"""A node in a process of its own: the command that starts it, and how it is ended."""

import json
import subprocess
import sys

NODE = [sys.executable, '-m', 'idem_ros.node.entry']
END_PATIENCE = 10.0  # [s]


def node_command(parameters: dict, log_level: str = 'error') -> list[str]:
    """Return the command of a node with parameters; other arguments of ROS may follow."""
    command = [*NODE, '--ros-args', '--log-level', f'idem_node:={log_level}']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={json.dumps(value)}']
    return command


def ended(child: subprocess.Popen) -> int:
    """Ask a process to end, make it where it does not; return its exit code."""
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(END_PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
    return child.wait()
