import numpy as np
from clouds import motion, surface
from costs import joint_entropy

from idem_ros.core import Cloud
from idem_ros.core.geometry import se3
from idem_ros.core.solve.block_sums import SUMS
from idem_ros.core.solve.linearization import linearize

UNTOUCHED = 0x7FF0000000000001  # a signalling NaN: whatever is added to it, be it 0, changes it


def test_no_row_of_the_sums_is_written_but_those_of_the_chosen(rng):
    """The others are of other threads: a row that two write, be it the same, loses a part."""
    cost = joint_entropy(*(Cloud(surface(rng, n, 0.003)) for n in (900, 700)), radius=0.1)
    T = motion(rng, 1.0, 0.01)
    group = tuple(np.arange(len(cloud.order)) % 3 for cloud in cost.balls.clouds)
    for chosen in (1, 2, 7):  # of 7 there are none
        sums = tuple(np.zeros((3, SUMS)) for _ in range(2))
        others = [g for g in range(3) if g != chosen]
        for each in sums:
            each.view(np.uint64)[others] = UNTOUCHED
        some = tuple(np.flatnonzero(each == chosen) for each in group)
        what = cost.balls.sides(T), se3.both_ways(T), cost.ball_cost
        linearize(*what, some, group, sums)
        for each in sums:
            assert (each.view(np.uint64)[others] == UNTOUCHED).all()
            assert chosen > 2 or each[chosen].any()
