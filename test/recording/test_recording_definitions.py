"""Definitions are read in linear time, and held against the standard's field by field."""

import pytest
from rosbags.typesys import Stores, get_typestore

from idem_ros.core.exceptions import IdemError
from idem_ros.messages.building import CLOUD
from idem_ros.recording.definitions import difference, parse
from idem_ros.recording.messages import typestore

NOETIC = get_typestore(Stores.ROS1_NOETIC)
IDL = """\
#include "std_msgs/msg/Header.idl"
module sensor_msgs { module msg {
  module PointField_Constants { const uint8 INT8 = (((((((((((1))))))))))); };
  @verbatim (language="comment", text="hello (world" "\\n more); }")
  struct PointField { string name; uint32 offset; uint8 datatype; @unit("1") uint32 count; };
  typedef octet octet__3[3]; enum Colour { RED, GREEN };
  struct Other { octet__3 three; Colour colour; sequence<string<5>, 4> words; };
}; };
module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };
module std_msgs { module msg {
  struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; // a word
}; };
module sensor_msgs { module msg {
  struct PointCloud2 {
    std_msgs::msg::Header header; uint32 height, width;
    sequence<sensor_msgs::msg::PointField> fields; boolean is_bigendian; uint32 point_step;
    uint32 row_step; sequence<uint8> data; /* a word */ boolean is_dense;
  };
}; };
"""


@pytest.mark.parametrize(('store', 'version'), [(typestore(), 2), (NOETIC, 1)])
def test_every_definition_of_the_standard_agrees_with_itself(store, version):
    names = [name for name in store.fielddefs if '/msg/' in name]
    assert len(names) > 100
    for name in names:
        text, _ = store.generate_msgdef(name, ros_version=version)
        assert difference(name, store, parse(f'ros{version}msg', text, name)) == ''


def test_idl_agrees_with_the_same_type_as_msg():
    recorded = parse('ros2idl', IDL, CLOUD)
    assert difference(CLOUD, typestore(), recorded) == ''
    assert recorded['sensor_msgs/msg/Other'] == [
        ('three', ('array', 'int8', 3)),
        ('colour', 'int32'),
        ('words', ('sequence', 'string')),
    ]
    swapped = parse('ros2idl', IDL.replace('height, width', 'width, height'), CLOUD)
    assert 'width stands where height should' in difference(CLOUD, typestore(), swapped)


@pytest.mark.parametrize(
    ('form', 'text'),
    [
        ('ros2msg', 'uint8[4,4] m'),
        ('ros2msg', 'x' * 10**6),
        ('ros2idl', 'module a { ' * 100),
        ('ros2idl', 'struct A { ' + 'sequence<' * 100),
        ('ros2idl', '}'),
        ('ros2idl', 'struct A { double x[(3)]; };'),
        ('ros2idl', 'hello'),
        ('protobuf', 'hello'),
    ],
)
def test_what_is_no_definition_is_refused_in_one_line(form, text):
    with pytest.raises(IdemError) as refused:
        parse(form, text, CLOUD)
    assert len(str(refused.value)) < 200
    assert '\n' not in str(refused.value)
