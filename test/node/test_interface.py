import subprocess
import sys
from dataclasses import field

from idem_ros.node.interface import INPUTS, OUTPUTS, parameter_fields
from idem_ros.parameters.fields import default_of, description_of


def test_every_parameter_is_described_and_named_once():
    names = [each.name for each in parameter_fields()]
    assert len(set(names)) == len(names)
    assert {'voxel_size', 'a', 'reliability', 'depth', 'target_durability'} <= set(names)
    assert all(len(description_of(each)) > 10 for each in parameter_fields())


def test_unit_and_meaning_of_zero_are_part_of_the_description():
    each = field(default=None, metadata={'description': 'edge', 'unit': 'm'})
    assert description_of(each) == 'edge [m]; 0.0 means none'
    assert default_of(each) == 0.0


def test_default_of_a_tuple_is_a_list():
    assert default_of(field(default=(4.0, 1.0))) == [4.0, 1.0]


def test_topics_of_the_node_are_private_but_for_the_diagnostics():
    names = [topic.name for topic in (*INPUTS.values(), *OUTPUTS.values())]
    assert [name for name in names if not name.startswith('~/')] == ['/diagnostics']


def test_interface_can_be_read_where_ros_is_not_installed():
    code = "import sys; sys.modules['rclpy'] = None; import idem_ros.node.interface"
    subprocess.run([sys.executable, '-c', code], check=True)
