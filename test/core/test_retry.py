from idem_ros.core.retry import Try, next_try

FIRST, WIDER = 'first stage', 'wider stage'


def test_the_first_stage_is_tried_first():
    assert next_try([], FIRST, WIDER) == (FIRST,)


def test_a_first_stage_that_ends_in_a_valley_is_enough():
    assert next_try([Try((FIRST,), 0.6)], FIRST, WIDER) == ()


def test_where_it_ends_in_no_valley_a_wider_stage_goes_before_it_once():
    tries = [Try((FIRST,), 0.4)]
    assert next_try(tries, FIRST, WIDER) == (WIDER, FIRST)
    assert next_try([*tries, Try((WIDER, FIRST), 0.1)], FIRST, WIDER) == ()


def test_a_wider_stage_whose_balls_would_hold_most_of_a_cloud_is_none():
    assert next_try([Try((FIRST,), 0.4)], FIRST, None) == ()
