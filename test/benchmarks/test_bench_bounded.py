from benchmarks.bounded import costs, garbage, overruns


def test_garbage_is_held_against_scans_in_clouds_and_in_maps(rng):
    found = list(costs(800, 0.5, rng))
    assert len(found) == 2 * len(garbage(5, rng))
    assert all(goal.measured > 0.0 for goal in found)


def test_every_way_to_register_is_held_to_a_budget(rng):
    figures = [goal.figure for goal in overruns(800, 1000.0, rng)]
    for way in ('a cloud', 'an audit', 'a map', 'a sweep', 'several', 'garbage in a line'):
        assert any(figure.startswith(f'{way}, 800 points') for figure in figures)
