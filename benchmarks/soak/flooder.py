"""Whoever floods the node, a process of its own: guesses, garbage and a clock that jumps.

Run as `python -m benchmarks.soak.flooder --seconds 60`.
"""

import argparse
import os
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
from idem_ros.recording.messages import cloud_message, to_cdr, transform_message

RATES = {'guesses': 10_000, 'clouds': 50, 'jumps': 10}  # a second
TICK = 0.005  # [s]
POINTS = 5000
HOUR = 3600 * 10**9
QUEUE = 1000  # what waits to be sent: all of a tick, and of some that were late
# DDS sends all that waits in one packet, and in a thread of its own: a flood is not to take the
# processors that the node needs
MODE = 'RMW_FASTRTPS_PUBLICATION_MODE', 'ASYNCHRONOUS'


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
    """Return CDR bytes of guesses of other frames, and of the right ones, but for the stamps."""
    poses = np.tile(np.eye(4), (8, 1, 1))
    poses[:, :3, 3] = rng.normal(0.0, 50.0, (8, 3))
    others = [to_cdr(transform_message(T, 0, 'here', 'there')) for T in poses]
    return others, [to_cdr(transform_message(T, 0, TARGET, SOURCE)) for T in poses]


def main():
    """Flood for some seconds; say how much of it was sent, and what that took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, required=True)
    for name, rate in RATES.items():
        parser.add_argument(f'--{name}', type=float, default=rate, help='a second')
    args = parser.parse_args()
    os.environ[MODE[0]] = MODE[1]
    with playing_node('idem_flood') as node:
        guess, cloud, jump = _senders(node)
        rates = {guess: args.guesses, cloud: args.clouds, jump: args.jumps}
        took = time.process_time()
        counts = _at_rates(rates, args.seconds)
        took = (time.process_time() - took) / args.seconds
    guessed, clouds, jumps = (count / args.seconds for count in counts)
    print(
        f'a flood of {guessed:.0f} guesses/s, {clouds:.0f} clouds/s, {jumps:.0f} jumps/s, which '
        f'took {100 * took:.0f} % of a core to send'
    )
    return 0


def _senders(node):
    """Return what sends guesses, clouds, and times of the clock, each told how many."""
    rng, chance = np.random.default_rng(0), random.Random(0)
    (of_source, of_target), (others, right) = garbage(rng), guesses(rng)
    make = node.create_publisher
    out = {name: make(PointCloud2, f'/idem_node/{name}', 10) for name in ('source', 'target')}
    clock = make(Clock, '/clock', 10)
    publish = make(TransformStamped, '/idem_node/initial_guess', QoSProfile(depth=QUEUE)).publish

    def guess(count):
        """Send some: each second one of other frames now, the others right, an hour off."""
        now = time.time_ns()
        late = now + chance.choice([-HOUR, HOUR, -HOUR // 36])
        kinds = (chance.choice(right), late), (chance.choice(others), now)
        for k in range(count):
            cdr, stamp = kinds[k % 2]
            publish(stamped(cdr, stamp + k))

    def cloud(count):
        """Send some, of the source or of the target."""
        for _ in range(count):
            name, kinds = chance.choice([('source', of_source), ('target', of_target)])
            out[name].publish(stamped(chance.choice(kinds), time.time_ns()))

    def jump(count):
        """Set the clock to any time."""
        message = Clock()
        message.clock.sec = chance.randrange(2**31)
        clock.publish(message)

    return guess, cloud, jump


def _at_rates(senders, seconds):
    """Have each send as many a second as it says; return how many that were."""
    begin, counts = time.monotonic(), dict.fromkeys(senders, 0)
    while (passed := time.monotonic() - begin) < seconds:
        for send, rate in senders.items():
            count = min(int(passed * rate) - counts[send], int(10 * TICK * rate) + 1)
            if count:
                send(count)
            counts[send] += count
        time.sleep(TICK)
    return counts.values()


if __name__ == '__main__':
    sys.exit(main())
