import numpy as np

from benchmarks.trust.convoys import LANES, Told, convoy, convoy_goals, told_of


def test_vehicles_stand_in_their_lanes_and_leave_room_for_the_sensor(rng):
    for lanes in LANES.values():
        boxes = convoy(lanes, rng).boxes
        assert len(boxes) > 20
        over = (np.abs(boxes[:, :2]) < boxes[:, 3:5]).all(axis=1)
        assert not over.any()


def test_what_is_told_among_vehicles_and_without():
    found = told_of('tunnel', 9200, True) + told_of('tunnel', 9200, False)
    assert [each.vehicles for each in found] == [True, True, False, False]
    assert not any(each.said for each in found[2:])


def test_goals_count_wrong_ones_called_aligned_and_alarms_without_cause():
    wrong = Told('town', True, right=False, usable=True, said=False)
    quiet = Told('town', False, right=True, usable=True, said=False)
    assert all(goal.reached for goal in convoy_goals([wrong._replace(usable=False), quiet]))
    assert not any(goal.reached for goal in convoy_goals([wrong, quiet._replace(said=True)]))
