"""Cases that no number of the solver was chosen on: new scans, other seeds, other bodies.

The benchmarks of accuracy and of trust draw from seeds below 1 000 and from other real scans.
"""

from collections import defaultdict
from functools import partial

import numpy as np

from benchmarks.case import Case, Unseen
from benchmarks.conditions import CONDITIONS, UNSEEN_SEEDS, condition, of_other_body
from benchmarks.lidar_cases import scan_to_map, scan_to_scan
from benchmarks.new_scans import scan_sets
from benchmarks.trust.sensors import place_case
from benchmarks.tunnels.trials import setup

SCENES = {'street': (0.5, 0.25, 1.0), 'room': (0.1, 0.2), 'forest': (0.5,)}
"""Scenes of the simulator and the voxel sizes they are registered at [m]; maps at the first."""
STARTS = {
    'near': (1.5, 1.0),
    'far': (10.0, 4.0),
    'farther': (15.0, 8.0),
    'wild': (30.0, 15.0),
    'wilder': (60.0, 30.0),
}
"""(degrees, multiple of the spacing) that guesses are off the truth."""


def unseen(quick=False, trials=None):
    """Return all `Unseen` cases; those of the real scans where they lie beside the checkout.

    quick: few of them.
    trials: of each group at most so many, drawn; None: all.
    """
    found = [*_real(), *_simulated(), *_in_tunnels(), *_in_places(), *_sampled()]
    found = found[::20] if quick else found
    return found if trials is None else [*_some_of_each(found, trials)]


def _some_of_each(cases, trials):
    groups = defaultdict(list)
    for case in cases:
        groups[case.group].append(case)
    rng = np.random.default_rng(UNSEEN_SEEDS[0])
    for of_group in groups.values():
        for k in sorted(rng.permutation(len(of_group))[:trials]):
            yield of_group[k]


def _real():
    for scans in scan_sets():
        for voxel in scans.voxel_sizes:
            for _, build in scans.pairs[::2]:
                yield Unseen(scans.name, partial(build, voxel), scans.right)


def _simulated():
    for kind, voxel_sizes in SCENES.items():
        made = [('scan-scan', scan_to_scan, voxel) for voxel in voxel_sizes]
        made.append(('scan-map', scan_to_map, voxel_sizes[0]))
        for how, build, voxel in made:
            for seed in UNSEEN_SEEDS[::2]:
                name = f'unseen {kind} {how} {voxel} {seed}'
                yield Unseen(kind, partial(build, name, kind, seed, voxel))


def _in_tunnels():
    """Yield tunnels and facades, with niches, posts, or nothing that tells the way along them."""
    for name in ('niches', 'posts', 'bare_tunnel', 'two_facades'):
        for seed in UNSEEN_SEEDS:
            yield Unseen(name, partial(_in_tunnel, name, seed))


def _in_places():
    """Yield open country, which slopes that lean a little hold."""
    for name in ('field', 'motorway'):
        for seed in UNSEEN_SEEDS:
            yield Unseen(name, partial(place_case, name, seed))


def _in_tunnel(name, seed):
    drawn = setup(name, seed)
    voxel_size = drawn.voxel_size
    return Case(f'unseen {name} {seed}', drawn.target, drawn.source, drawn.truth, voxel_size)


def _sampled():
    for name in CONDITIONS:
        for seed in UNSEEN_SEEDS:
            yield Unseen(name, partial(condition, name, seed))
            yield Unseen(f'other bodies: {name}', partial(of_other_body, name, seed))
