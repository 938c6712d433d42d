"""How well real scans determine their poses: registrations around a ring of three should close.

So should one pair's at two voxel sizes. No truth is needed. What is left over is the scans' own,
their distortion and what each pair happens to share. No method can be told right or wrong by less.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from benchmarks.methods import IDEM, PEERS, Setting, idem_solver, peer_solvers
from benchmarks.real_pairs import real_case, real_pairs
from idem_ros.core.geometry import se3
from idem_ros.terminal.markdown import number, table

RINGS = (('000', '045', '315'), ('000', '045', '090'))  # scans of the bunny


@dataclass(frozen=True)
class Ring:
    """Scans, and by how much each method's registrations of them fail to close.

    Attributes:
        name: of the scans, and their voxels: three scans at one size, or a pair at two.
        gaps: method -> (rotation [deg], translation [m]), of a peer at the setting that closes
            best by rotation.
    """

    name: str
    gaps: dict


def measure_rings(config, settings, quick=False, progress=lambda rings: rings):
    """Return `Ring`s of the bunny at each voxel size, and of small_gicp's pair; none without them.

    Args:
        config: `RegistrationConfig` of IDEM.
        settings: the peers' `Setting`s that are tried.
        quick: the widest voxels only.
        progress: wraps the iteration over the rings.
    """
    pairs = dict(real_pairs())
    sizes = sorted({name.split()[2] for name in pairs if name.startswith('bunny')}, key=int)
    rings = {
        f'bunny {a}-{b}-{c} {size} mm': [
            f'bunny {x} {size} mm' for x in (f'{a}-{b}', f'{b}-{c}', f'{a}-{c}')
        ]
        for size in (sizes[-1:] if quick else sizes)
        for a, b, c in RINGS
    }
    both = [name for name in pairs if name.startswith('small_gicp')]
    if both and not quick:
        rings[' and '.join(both).replace(' mm and small_gicp', ' and')] = both
    found = []
    for name, names in progress(rings.items()):
        cases = [real_case(each, *pairs[each]) for each in names]
        found.append(Ring(name, _gaps(cases, config, settings)))
    return found


def rings_table(rings):
    """Return `Ring`s as a Markdown table."""
    methods = [method for method in (IDEM, *PEERS) if rings and method in rings[0].gaps]
    return table(
        ('ring', *(f'{method} [deg] / [mm]' for method in methods)),
        [[ring.name, *(_cell(*ring.gaps[method]) for method in methods)] for ring in rings],
    )


def _cell(rotation_deg, translation_m):
    return f'{number(rotation_deg)} / {number(translation_m, 1e3)}'


def _gaps(cases, config, settings):
    solvers = [{Setting(IDEM): idem_solver(case, config)} for case in cases]
    for case, of_case in zip(cases, solvers, strict=True):
        of_case.update(peer_solvers(case, settings))
    gaps = {}
    for setting in solvers[0]:
        gap = closing(
            *(of[setting](case.truth)[0] for of, case in zip(solvers, cases, strict=True))
        )
        gaps[setting.method] = min(gap, gaps.get(setting.method, gap))
    return gaps


def closing(*transforms):
    """Return by how much a way of registrations differs from the last one, [deg] and length."""
    *way, across = transforms
    off = reduce(np.matmul, (*way, se3.inverse(across)))
    return float(np.rad2deg(se3.rotation_angle(off))), float(np.linalg.norm(off[:3, 3]))
