"""How well real scans determine their poses: registrations around a ring of three should close.

No truth is needed. What is left over is the scans' own: their distortion, and what each pair
happens to share. No method can be told right or wrong by less.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from idem_ros.benchmarks.markdown import number, table
from idem_ros.benchmarks.methods import IDEM, PEERS, Setting, idem_solver, peer_solvers
from idem_ros.benchmarks.real_pairs import real_case, real_pairs
from idem_ros.core import se3

RINGS = (('000', '045', '315'), ('000', '045', '090'))  # scans of the bunny


@dataclass(frozen=True)
class Ring:
    """Three scans, and by how much each method's three registrations fail to close.

    Attributes:
        name: of the scans, and their voxels.
        gaps: method -> (rotation [deg], translation [m]), of a peer at the setting that closes
            best by rotation.
    """

    name: str
    gaps: dict


def measure_rings(config, settings, quick=False, progress=lambda rings: rings):
    """Return `Ring`s of the bunny at each voxel size; none without its scans.

    Args:
        config: `RegistrationConfig` of IDEM.
        settings: the peers' `Setting`s that are tried.
        quick: the widest voxels only.
        progress: wraps the iteration over the rings.
    """
    pairs = dict(real_pairs())
    sizes = sorted({name.split()[2] for name in pairs if name.startswith('bunny')}, key=int)
    found = []
    sizes = sizes[-1:] if quick else sizes
    for size, ring in progress([(size, ring) for size in sizes for ring in RINGS]):
        a, b, c = ring
        names = [f'bunny {x}-{y} {size} mm' for x, y in ((a, b), (b, c), (a, c))]
        cases = [real_case(name, *pairs[name]) for name in names]
        found.append(Ring(f'bunny {"-".join(ring)} {size} mm', _gaps(cases, config, settings)))
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


def closing(T_ab, T_bc, T_ac):
    """Return by how much a way of two registrations differs from the third, [deg] and length."""
    off = reduce(np.matmul, (T_ab, T_bc, se3.inverse(T_ac)))
    return float(np.rad2deg(se3.rotation_angle(off))), float(np.linalg.norm(off[:3, 3]))
