import json

import numpy as np
import pytest
from clouds import motion

from benchmarks.commands.main import main
from benchmarks.real_pairs import real_pairs
from benchmarks.rings import Ring, closing, rings_table


def test_registrations_around_a_ring_close(rng):
    T_ab, T_bc = motion(rng, 50, 2.0), motion(rng, 80, 1.0)
    np.testing.assert_allclose(closing(T_ab, T_bc, T_ab @ T_bc), 0.0, atol=1e-6)


def test_an_error_of_one_of_them_is_the_gap(rng):
    T_ab, T_bc, error = motion(rng, 50, 2.0), motion(rng, 80, 1.0), motion(rng, 0.3, 0.01)
    degrees, length = closing(T_ab, T_bc, error @ T_ab @ T_bc)
    assert degrees == pytest.approx(0.3)
    assert length == pytest.approx(0.01)


def test_the_table_names_each_method():
    text = rings_table([Ring('bunny a-b-c 1 mm', {'IDEM': (0.1, 2e-4), 'GICP': (0.2, 3e-4)})])
    assert text.splitlines()[0].split('|')[2:4] == [' IDEM [deg] / [mm] ', ' GICP [deg] / [mm] ']
    assert '0.1 / 0.2' in text
    assert '0.2 / 0.3' in text


def test_the_rings_of_the_bunny_are_measured(tmp_path, capsys):
    pytest.importorskip('small_gicp')
    if not any(name.startswith('bunny') for name, _ in real_pairs()):
        pytest.skip("the bunny's scans are not here")
    file = tmp_path / 'rings.json'
    assert main(['rings', '--quick', '--json', str(file)]) == 0
    rings = json.loads(file.read_text())['rings']
    assert [ring['name'].split()[1] for ring in rings] == ['000-045-315', '000-045-090']
    assert all(0.0 < degrees < 0.5 for ring in rings for degrees, _ in [ring['gaps']['IDEM']])
    assert 'bunny 000-045-090 4 mm' in capsys.readouterr().out
