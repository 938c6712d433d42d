import numpy as np
from clouds import motion, surface
from costs import joint_entropy

from idem_ros.core import Cloud
from idem_ros.core.solve.block_sums import SUMS, of_both
from idem_ros.core.solve.linearization import NOT_MET, linearize

UNTOUCHED = 0x7FF0000000000001  # a signalling NaN: whatever is added to it, be it 0, changes it


def test_no_row_of_the_sums_is_written_but_those_of_the_chosen(rng):
    """The others are of other threads: a row that two write, be it the same, loses a part."""
    cost = joint_entropy(*(Cloud(surface(rng, n, 0.003)) for n in (900, 700)), radius=0.1)
    T = motion(rng, 1.0, 0.01)
    group = tuple(np.arange(len(cloud.order)) % 3 for cloud in cost.balls.clouds)
    for chosen in (1, 2, 7):  # of 7 there are none
        sums = tuple(np.zeros((1, 3, SUMS)) for _ in range(2))
        others = [g for g in range(3) if g != chosen]
        for each in sums:
            each.view(np.uint64)[:, others] = UNTOUCHED
        some = tuple(np.flatnonzero(each == chosen) for each in group)
        what = cost.balls.sides(T), NOT_MET, T[None], cost.ball_cost
        linearize(*what, some, group, sums)
        for each in sums:
            assert (each.view(np.uint64)[:, others] == UNTOUCHED).all()
            assert chosen > 2 or each[:, chosen].any()


def test_at_several_transforms_it_is_what_it_is_at_each(rng):
    cost = joint_entropy(*(Cloud(surface(rng, n, 0.003)) for n in (900, 700)), radius=0.2)
    transforms = np.array([motion(rng, 0.1, 0.001) for _ in range(3)])  # within the pairs' skin
    everyone = tuple(np.arange(len(cloud.order)) for cloud in cost.balls.clouds)
    one_group = tuple(np.zeros_like(each) for each in everyone)
    sums = tuple(np.zeros((2, 3, 1, SUMS)))
    linearize(
        cost.balls.sides(transforms[0]),
        NOT_MET,
        transforms,
        cost.ball_cost,
        everyone,
        one_group,
        sums,
    )
    of_each = (of_side.reshape(1, 3, SUMS) for of_side in sums)
    _, gradients, matrices = of_both(*of_each, transforms)
    for T, gradient, matrix in zip(transforms, gradients, matrices, strict=True):
        expected = cost.linearize(T)
        np.testing.assert_allclose(gradient, expected.gradient, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(matrix, expected.matrix, rtol=1e-9, atol=1e-9)
