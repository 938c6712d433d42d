"""Whoever floods the node, a process of its own: guesses, garbage and a clock that jumps.

Run as `python -m benchmarks.soak.flooder --seconds 60`.
"""

import argparse
import random
import sys
import time

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2

from benchmarks.soak.stream import SOURCE, TARGET, stamped
from idem_ros.node.player import playing_node
from idem_ros.recording.cdr import to_cdr
from idem_ros.recording.messages import cloud_message, transform_message

RATES = {'guesses': 10_000, 'clouds': 50, 'jumps': 10}  # a second
TICK = 0.002  # [s]
POINTS = 5000
HOUR = 3600 * 10**9


def garbage(rng):
    """Return CDR bytes of clouds that no registration can use: of the source, of either."""
    floats = np.frombuffer(rng.bytes(12 * POINTS), '<f4').reshape(-1, 3)
    unread = cloud_message(floats, 0, SOURCE)
    unread.row_step += 5
    nameless = cloud_message(floats, 0, SOURCE)
    nameless.fields = nameless.fields[:2]
    nothing = cloud_message(np.full((POINTS, 3), np.nan), 0, SOURCE)
    turned = cloud_message(rng.normal(size=(POINTS, 3)), 0, SOURCE)
    turned.is_bigendian = True
    malformed = [to_cdr(each) for each in (unread, nameless, nothing)]
    return [to_cdr(cloud_message(floats, 0, SOURCE)), to_cdr(turned), *malformed], malformed


def guesses(rng):
    """Return CDR bytes of guesses of other frames, and of the right ones."""
    poses = np.tile(np.eye(4), (8, 1, 1))
    poses[:, :3, 3] = rng.normal(0.0, 50.0, (8, 3))
    others = [to_cdr(transform_message(T, 0, 'here', 'there')) for T in poses]
    return others, [to_cdr(transform_message(T, 0, TARGET, SOURCE)) for T in poses]


def main():
    """Flood for some seconds; say how much of it was sent."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, required=True)
    for name, rate in RATES.items():
        parser.add_argument(f'--{name}', type=float, default=rate, help='a second')
    args = parser.parse_args()
    rng, chance = np.random.default_rng(0), random.Random(0)
    (of_source, of_target), (others, right) = garbage(rng), guesses(rng)
    with playing_node('idem_flood') as node:
        make = node.create_publisher
        inputs = {'source': PointCloud2, 'target': PointCloud2, 'initial_guess': TransformStamped}
        out = {
            name: make(kind, f'/idem_node/{name}', QoSProfile(depth=10))
            for name, kind in inputs.items()
        }
        clock = make(Clock, '/clock', 10)

        def guess():
            """Send one: of other frames now, or of the right ones an hour off."""
            now = time.time_ns()
            late = now + chance.choice([-HOUR, HOUR, -HOUR // 36])
            sent = stamped(chance.choice(right), late)
            out['initial_guess'].publish(
                sent if chance.random() < 0.5 else stamped(chance.choice(others), now)
            )

        def cloud():
            """Send one, of the source or of the target."""
            name, kinds = chance.choice([('source', of_source), ('target', of_target)])
            out[name].publish(stamped(chance.choice(kinds), time.time_ns()))

        def jump():
            """Set the clock to any time."""
            message = Clock()
            message.clock.sec = chance.randrange(2**31)
            clock.publish(message)

        rates = {guess: args.guesses, cloud: args.clouds, jump: args.jumps}
        counts = _at_rates(rates, args.seconds)
    guessed, clouds, jumps = (count / args.seconds for count in counts)
    print(f'a flood of {guessed:.0f} guesses/s, {clouds:.0f} clouds/s, {jumps:.0f} jumps/s')
    return 0


def _at_rates(senders, seconds):
    """Call each as often a second as it says; return how often that was."""
    begin, counts = time.monotonic(), dict.fromkeys(senders, 0)
    while (passed := time.monotonic() - begin) < seconds:
        for send, rate in senders.items():
            for _ in range(min(int(passed * rate) - counts[send], int(10 * TICK * rate) + 1)):
                send()
                counts[send] += 1
        time.sleep(TICK)
    return counts.values()


if __name__ == '__main__':
    sys.exit(main())
