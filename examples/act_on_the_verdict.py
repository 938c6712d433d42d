"""A listener that acts on the verdict: the robot slows down while its pose is in doubt.

python examples/act_on_the_verdict.py --ros-args -r speed_limit:=/speed_limit
"""

from contextlib import suppress

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64

FULL, CAREFUL, STOP = 2.0, 0.5, 0.0  # [m/s]
PATIENCE = 5  # results in doubt, one after another, until it stops


class SpeedByVerdict(Node):
    """A speed limit from the statuses "registration" of idem_node."""

    def __init__(self, **options):
        super().__init__('speed_by_verdict', **options)
        self._doubts = 0
        self._limit = self.create_publisher(Float64, 'speed_limit', 10)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_diagnostics(self, message):
        for status in message.status:
            said = {each.key: each.value for each in status.values}
            if not status.name.endswith(': registration') or 'verdict' not in said:
                continue
            good = said['verdict'] == 'aligned'
            self._doubts = 0 if good else self._doubts + 1
            if not good:
                self.get_logger().warning(f'{said["verdict"]}: {said["verdict_reason"]}')
            limit = FULL if good else CAREFUL if self._doubts < PATIENCE else STOP
            self._limit.publish(Float64(data=limit))


def main():
    """Run until Ctrl-C."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(SpeedByVerdict())


if __name__ == '__main__':
    main()
