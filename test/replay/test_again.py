import numpy as np

from idem_ros.replay.again import agreement


def frames(count):
    return [
        {'stamp_ns': i, 'T_target_source': np.eye(4).tolist(), 'q_tot': 0.5, 'status': 'converged'}
        for i in range(count)
    ]


def test_the_same_frames_agree():
    found = agreement(frames(3), frames(3))
    assert (found.agreeing, found.frames, found.first) == (3, 3, '')


def test_what_differs_is_named_with_what_it_was_and_is():
    other = frames(3)
    other[1].update(q_tot=0.25, status='degenerate')
    found = agreement(frames(3), other)
    assert found.agreeing == 2
    assert found.first == (
        'frame 1 (stamp 0.000000001 s): q_tot was 0.5 and is 0.25, '
        "status was 'converged' and is 'degenerate'"
    )


def test_a_frame_that_only_one_has_does_not_agree():
    found = agreement(frames(3), frames(2))
    assert (found.agreeing, found.frames) == (2, 3)
    assert found.first == 'frame 2 (stamp 0.000000002 s) is in the recorded result only'
    assert 'repeated result only' in agreement(frames(1), frames(2)).first


def test_a_last_bit_is_a_difference_and_so_is_the_sign_of_zero():
    other = frames(1)
    for value, difference in ((5e-324, '4.94e-324'), (-0.0, '0')):
        other[0]['T_target_source'][0][1] = value
        found = agreement(frames(1), other)
        assert found.first.endswith(f'T_target_source differs by up to {difference}')
