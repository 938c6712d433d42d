from idem_ros.messages.stamps import DISORDER, StampOrder, seconds

START, STEP = 10**12, 10**8


def test_stamps_that_rise_repeat_or_are_a_little_late_do_not_go_back():
    order = StampOrder()
    stamps = [START, START, START + STEP, START, START + 9 * STEP, START + 9 * STEP - DISORDER, 0]
    assert not any([order.goes_back('source', stamp) for stamp in stamps])
    assert order.jumps == 0


def test_a_clock_that_is_set_back_is_counted_once_over_all_streams():
    order = StampOrder()
    for stream in ('source', 'guess'):
        assert not order.goes_back(stream, START + 50 * STEP)
    assert order.goes_back('guess', START)
    assert not order.goes_back('source', START + STEP)
    assert not order.clock_goes_back(START)
    assert (order.jumps, order.last_jump) == (1, 50 * STEP)
    assert not order.goes_back('source', START + 50 * STEP)
    assert order.goes_back('source', START)
    assert order.jumps == 2


def test_a_stream_that_leaps_between_clocks_sets_none_back():
    order = StampOrder()
    told = [order.stays_back('guess', START + i % 2 * 50 * STEP) for i in range(9)]
    assert not any(told[:2] + told[3:])
    assert (order.jumps, order.clock_goes_back(START)) == (1, False)


def test_a_recording_in_a_loop_sets_its_clock_back_each_time():
    order = StampOrder()
    for _ in range(4):
        for i in range(20):
            order.stays_back('guess', START + i * STEP)
    assert order.jumps == 3


def test_the_nodes_own_clock_set_back_counts_where_something_is_newer():
    order = StampOrder()
    assert not order.clock_goes_back(START)
    order.goes_back('source', START)
    assert not order.clock_goes_back(START - DISORDER)
    assert order.clock_goes_back(START - DISORDER - 1)
    assert not order.goes_back('source', START - DISORDER)
    assert order.jumps == 1


def test_streams_do_not_compare_their_stamps():
    order = StampOrder()
    order.goes_back('source', START)
    assert not order.goes_back('guess', START - 10 * DISORDER)


def test_times_are_said_in_seconds():
    assert seconds(1_250_000_000) == '1.25 s'
