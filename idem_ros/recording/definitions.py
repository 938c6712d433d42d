"""Message definitions as recorded: read in linear time, and held against the standard's.

A definition comes from whoever wrote the recording. It is never compiled: where its bytes on the
wire are those of the standard's type, that one reads them.
"""

import re

from rosbags.interfaces import Nodetype

from idem_ros.core.exceptions import IdemError
from idem_ros.recording.definitions_idl import parse_idl

LONGEST = 2**18  # characters; those of whole packages have a tenth
SEPARATOR = re.compile(r'^={20,}\s*$', re.MULTILINE)
FIELD = re.compile(
    r'(?P<type>[A-Za-z][\w/]*)(<=\d+)?(?P<array>\[(<=)?\d*\])?\s+(?P<name>[A-Za-z]\w*)(\s.*)?'
)
CONSTANT = re.compile(r'[A-Za-z][\w/]*(<=\d+)?\s+[A-Za-z]\w*\s*=')
KINDS = {
    **dict.fromkeys(('bool', 'byte', 'char', 'int8', 'uint8'), 'int8'),
    **{f'{sign}int{bits}': f'int{bits}' for sign in ('', 'u') for bits in (16, 32, 64)},
    **{name: name for name in ('float32', 'float64', 'string', 'wstring')},
}
"""What a base type is on the wire: of whole numbers only the size tells."""
TIMES = {
    'time': 'builtin_interfaces/msg/Time',
    'duration': 'builtin_interfaces/msg/Duration',
    'Header': 'std_msgs/msg/Header',
}
FILLER = 'structure_needs_at_least_one_member'


class UnreadableDefinition(IdemError):
    """A message definition that is none, or that holds what no message of ROS does."""


def parse(form, text, msgtype):
    """Read a definition with those it uses.

    Args:
        form: 'ros2msg', 'ros1msg', 'ros2idl' or 'omgidl', as MCAP calls them.
        text: the definition.
        msgtype: what it defines, such as 'std_msgs/msg/Header'.

    Returns:
        {type: [(field, its type)]}; a type is a kind of `KINDS`, ('name', type),
        ('sequence', type) or ('array', type, length).

    Raises:
        UnreadableDefinition: in one line.
    """
    if len(text) > LONGEST:
        raise UnreadableDefinition(
            f'the definition of {msgtype} has {len(text)} characters; {LONGEST} are read at most'
        )
    if form in ('ros2idl', 'omgidl'):
        return parse_idl(text)
    if form not in ('ros2msg', 'ros1msg'):
        raise UnreadableDefinition(f'the definition of {msgtype} is of no known form: {form!r}')
    return _parse_msg(text, msgtype)


def difference(msgtype, store, recorded):
    """Say where a recorded type differs on the wire from the standard's; empty where nowhere.

    Args:
        msgtype: such as 'sensor_msgs/msg/PointCloud2'.
        store: the `Typestore` of the standard, which has it.
        recorded: see `parse`.
    """
    return _of_struct(msgtype, msgtype, store, recorded, '')


def _parse_msg(text, msgtype):
    types = {}
    for block in SEPARATOR.split(text):
        name, lines = msgtype, block.strip('\n').splitlines()
        if lines and lines[0].startswith('MSG:'):
            name = normalized(lines[0].removeprefix('MSG:').strip())
            lines = lines[1:]
        types.setdefault(name, [each for line in lines if (each := _field(line, name))])
    return types


def _field(line, owner):
    """Return (field, type) of a line; None of a constant, a comment, an annotation."""
    line = line.split('#', 1)[0].strip()
    if not line or line.startswith('@') or CONSTANT.match(line):
        return None
    match = FIELD.fullmatch(line)
    if match is None:
        raise UnreadableDefinition(f'the definition of {owner} has the line {line[:60]!r}')
    kind = _type(match['type'], owner)
    if array := match['array']:
        length = array.strip('[]')
        is_array = length.isdigit()
        kind = ('array', kind, int(length[:18])) if is_array else ('sequence', kind)
    return match['name'], kind


def _type(name, owner):
    if name in KINDS:
        return KINDS[name]
    if name in TIMES:
        return 'name', TIMES[name]
    return 'name', normalized(name) if '/' in name else f'{owner.rpartition("/")[0]}/{name}'


def normalized(name):
    """Return the name of a type as ROS 2 has it: std_msgs/msg/Header of std_msgs/Header.

    IDL parts it by ::.
    """
    name = name.replace('::', '/')
    package, slash, last = name.rpartition('/')
    is_short = slash and '/' not in package
    return f'{package}/msg/{last}' if is_short else name


def _of_struct(standard_name, recorded_name, store, recorded, place):
    if recorded_name not in recorded:
        # writers leave out what a type uses; of the same name it is taken to be the same
        is_left_out = place and recorded_name == standard_name
        return '' if is_left_out else f'{place}{recorded_name} is not defined'
    standard = [each for each in store.fielddefs[standard_name][1] if each[0] != FILLER]
    found = [each for each in recorded[recorded_name] if each[0] != FILLER]
    for (name, kind), (recorded_field, recorded_kind) in zip(standard, found, strict=False):
        if name.lower() != recorded_field.lower():
            return f'{place}{recorded_field} stands where {place}{name} should'
        if reason := _of_field(kind, recorded_kind, store, recorded, f'{place}{name}'):
            return reason
    if len(found) != len(standard):
        which, fields = ('lacks', standard) if len(found) < len(standard) else ('adds', found)
        return f'it {which} {place}{fields[min(len(found), len(standard))][0]}'
    return ''


def _of_field(kind, recorded_kind, store, recorded, place):
    node, description = kind
    if node == Nodetype.BASE:
        same = KINDS.get(description[0]) == recorded_kind
        return '' if same else f'{place} is {_text(recorded_kind)} instead of {description[0]}'
    if node == Nodetype.NAME:
        if isinstance(recorded_kind, str) or recorded_kind[0] != 'name':
            return f'{place} is {_text(recorded_kind)} instead of {description}'
        return _of_struct(description, recorded_kind[1], store, recorded, f'{place}.')
    inner, length = description
    is_array = node == Nodetype.ARRAY
    shape = ('array', length) if is_array else ('sequence',)
    if isinstance(recorded_kind, str) or (recorded_kind[0], *recorded_kind[2:]) != shape:
        wanted = f'an array of {length}' if is_array else 'a sequence'
        return f'{place} is {_text(recorded_kind)} instead of {wanted}'
    return _of_field(inner, recorded_kind[1], store, recorded, f'{place}[]')


def _text(kind):
    if isinstance(kind, str):
        return kind
    if kind[0] == 'name':
        return kind[1]
    return f'{_text(kind[1])}[{kind[2] if kind[0] == "array" else ""}]'
