"""The node in this process: parameters given at its start and changed while it runs."""

import pytest
from node_bench import FIRST, MS, send, values_of

# isort: split
import numpy as np
from rclpy.parameter import Parameter

from idem_ros.core import InvalidConfig, RegistrationConfig, register
from idem_ros.messages.transform_message import matrix_of
from idem_ros.node.parameters import unknown_parameters


def test_parameter_changed_while_it_runs_holds_for_the_next_pair(bench, clouds):
    b = bench().start()
    (result,) = b.node.set_parameters([Parameter('max_iterations', value=1)])
    assert result.successful
    send(b, clouds, FIRST)
    expected = register(*clouds, np.eye(4), RegistrationConfig(max_iterations=1))
    np.testing.assert_allclose(
        matrix_of(b.transform_of(FIRST)), expected.T_target_source, rtol=0, atol=1e-9
    )


def test_points_are_left_out_by_parameters_changed_while_it_runs(bench, clouds):
    b = bench().start()
    changed = [Parameter('crop_max', value=[2.0, 9.0, 9.0]), Parameter('max_points', value=300)]
    assert all(result.successful for result in b.node.set_parameters(changed))
    send(b, clouds, FIRST)
    b.until(lambda: b.statuses('converged'))
    values = values_of(b.statuses('converged')[0])
    assert (values['points_target'], values['points_source']) == ('300', '300')
    assert int(values['cropped']) == np.count_nonzero(clouds[1][:, 0] > 2.0)
    (result,) = b.node.set_parameters([Parameter('min_range', value=1000.0)])
    assert result.successful
    send(b, clouds, FIRST + 100 * MS)
    b.until(lambda: b.statuses('refused'))
    assert 'min_range 1000.0 m' in b.statuses('refused')[0].message


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('a', -1.0, 'Parameter a out of range'),
        ('radius_schedule', [1.0, 2.0], 'it must go from coarse to fine'),
        ('length_scale', 'metre', 'it must be one of'),
        ('crop_min', [1.0], 'it must be three numbers'),
        ('depth', 7, 'read-only'),
    ],
)
def test_bad_parameter_is_refused_while_it_runs_and_the_old_value_kept(bench, name, value, reason):
    b = bench().start()
    before = b.node.get_parameter(name).value
    (result,) = b.node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert reason in result.reason
    assert b.node.get_parameter(name).value == before


def test_parameters_that_contradict_each_other_are_refused_together(bench):
    b = bench().start()
    both = [Parameter('min_range', value=5.0), Parameter('max_range', value=2.0)]
    result = b.node.set_parameters_atomically(both)
    assert not result.successful
    assert 'min_range is 5.0, max_range is 2.0' in result.reason
    both[1] = Parameter('max_range', value=20.0)
    assert b.node.set_parameters_atomically(both).successful


def test_bad_parameter_at_the_start_raises(bench):
    with pytest.raises(InvalidConfig, match='length_scale'):
        bench(length_scale='metre').start()


def test_what_is_no_parameter_is_named_at_the_start(bench, capfd):
    b = bench(voxelsize=0.5, other_node_s=1).start()
    assert unknown_parameters(b.node) == ['voxelsize (voxel_size?)', 'other_node_s']
    assert 'no parameter of this node: voxelsize (voxel_size?)' in capfd.readouterr().err


def test_what_it_waits_for_is_on_the_console(bench, capfd):
    b = bench().start()
    b.until(lambda: b.statuses('waiting'))
    assert 'waiting for target' in capfd.readouterr().err


def test_what_is_changed_while_it_runs_is_on_the_console(bench, capfd):
    b = bench().start()
    b.node.set_parameters([Parameter('voxel_size', value=0.25)])
    b.node.set_parameters([Parameter('a', value=-1.0)])
    said = capfd.readouterr().err
    assert 'voxel_size is 0.25 from now on' in said
    assert 'a is' not in said


def test_parameter_cannot_be_deleted_and_is_set_as_before(bench):
    b = bench().start()
    (result,) = b.node.set_parameters([Parameter('max_range')])
    assert not result.successful
    assert 'max_range cannot be deleted' in result.reason
    (result,) = b.node.set_parameters([Parameter('max_range', value=30.0)])
    assert result.successful
