"""Table 2 as the paper prints it."""

from typing import NamedTuple

METRICS = {  # columns of errors, and how tables name them
    'q_tot': 'q_tot',
    'rmse_12': 'RMSE 1→2',
    'rmse_21': 'RMSE 2→1',
    'chamfer': 'Chamfer',
    'hausdorff': 'Hausdorff',
}


class Printed(NamedTuple):
    """A row: numbers of points, r_4th and the errors of `METRICS` [mm; the stairs: m]."""

    points: tuple
    r_4th: float
    errors: tuple


PAPER = {
    'B0-B0': Printed((1597, 1597), 3.13, (0, 0, 0, 0, 0)),
    'B0-B0.9': Printed((1597, 1437), 3.50, (0, 0, 0, 0, 1.6)),
    'B0-B0.7': Printed((1597, 1118), 3.79, (0, 0, 0, 0, 0.79)),
    'B0-B0.5': Printed((1597, 799), 4.30, (0, 0, 0, 0, 1.52)),
    'B0-B0.3': Printed((1597, 479), 5.50, (0, 0.25, 0, 0, 2.46)),
    'B0-B0.1': Printed((1597, 160), 9.67, (0, 0.35, 0, 0, 3.04)),
    'B0-Bn0.05': Printed((1597, 1677), 3.55, (0, 0, 0, 0, 10.82)),
    'B0-Bn0.10': Printed((1597, 1757), 3.68, (0, 0, 0.25, 0, 13.44)),
    'B0-Bn0.15': Printed((1597, 1837), 3.73, (0, 0, 0.56, 0, 7.39)),
    'B0-Bn0.20': Printed((1597, 1916), 3.77, (0, 0, 0.36, 0, 14.98)),
    'B0-Bn0.25': Printed((1597, 1996), 3.80, (0, 0, 0.71, 0, 8.28)),
    'B0-Bh5': Printed((1597, 1447), 3.45, (0, 0, 0, 0, 3.55)),
    'B0-Bh10': Printed((1597, 1297), 3.50, (0, 0, 0, 0, 6.10)),
    'B0-Bh15': Printed((1597, 1147), 3.51, (0, 0, 0, 0, 4.56)),
    'B0-Bh20': Printed((1597, 997), 3.50, (0, 0.35, 0, 0, 7.27)),
    'B0-Bh25': Printed((1597, 847), 3.62, (0, 0.90, 0, 0, 5.27)),
    'B0p1-B0p2': Printed((1087, 1112), 3.44, (0, 8.31, 8.28, 0, 23.69)),
    'B0-B0r': Printed((1597, 968), 4.04, (0, 0.25, 0.35, 0, 2.46)),
    'B0p1-Brp': Printed((1087, 967), 3.42, (0, 15.21, 10.20, 11.92, 24.14)),
    'S1-S2': Printed((34101, 16101), 0.14, (0, 6.40, 7.28, 6.02, 5.32)),
}
