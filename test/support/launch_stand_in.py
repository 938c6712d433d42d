"""What stands in for `launch`, which has no wheel: it carries out what a file says."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

from conftest import ROOT


class Substitution:
    """An argument of launch by its name."""

    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return context.configurations[self.name]


class Condition(Substitution):
    """Whether an argument of launch says true."""

    def __init__(self, substitution):
        super().__init__(substitution.name)

    def evaluate(self, context):
        return self.perform(context).lower() in {'true', '1'}


class Source:
    """A launch file that another one includes."""

    def __init__(self, path):
        self.path = path

    def get_launch_description(self, context):
        return description_in(self.path)


class Description(list):
    """What a launch file declares and does."""

    def get_launch_arguments(self):
        return [each for each in self if each.kind == 'DeclareLaunchArgument']


def recorded(*kinds):
    """Return what stands in for kinds of actions: {kind: what keeps its arguments}."""

    def recording(kind):
        return lambda *positional, **keywords: SimpleNamespace(
            kind=kind,
            positional=positional,
            name=positional[0] if positional else keywords.pop('name', None),
            **keywords,
        )

    return {kind: recording(kind) for kind in kinds}


MODULES = {
    'ament_index_python.packages': {
        'get_package_share_directory': lambda name: str(ROOT),
        'get_package_prefix': lambda name: str(ROOT),
        'PackageNotFoundError': KeyError,
    },
    'launch': {'LaunchDescription': Description},
    'launch.actions': recorded(
        'DeclareLaunchArgument',
        'ExecuteProcess',
        'IncludeLaunchDescription',
        'OpaqueFunction',
        'RegisterEventHandler',
        'SetEnvironmentVariable',
        'Shutdown',
        'UnregisterEventHandler',
    ),
    'launch.conditions': {'IfCondition': Condition},
    'launch.event_handlers': recorded('OnProcessIO'),
    'launch.launch_description_sources': {'PythonLaunchDescriptionSource': Source},
    'launch.substitutions': {'LaunchConfiguration': Substitution},
    'launch_ros': {},
    'launch_ros.actions': recorded('Node'),
    'launch_ros.substitutions': {'ExecutableInPackage': lambda *names: '/'.join(names[::-1])},
}


def installed(monkeypatch):
    """Put the stand-ins in the place of the packages."""
    for name, attributes in MODULES.items():
        module = ModuleType(name)
        vars(module).update(attributes)
        monkeypatch.setitem(sys.modules, name, module)


def description_in(path):
    return runpy.run_path(str(path))['generate_launch_description']()


class Launched:
    """What `ros2 launch` does with a launch file and arguments; each is a word NAME:=VALUE.

    Attributes:
        actions: those that were carried out, in their order, as `recorded` keeps them.
    """

    def __init__(self, path, *arguments):
        self.argv, self.actions = arguments, []
        self.configurations = dict(word.split(':=', 1) for word in arguments)
        self._visit(description_in(path))

    def of_kind(self, kind):
        return [each for each in self.actions if each.kind == kind]

    def node(self, package):
        (node,) = [each for each in self.of_kind('Node') if each.package == package]
        return node

    def value(self, given):
        return given.perform(self) if isinstance(given, Substitution) else given

    def parameters(self, package):
        """Return the parameter file of a node, and {name: value} that is given beside it."""
        file, *others = self.node(package).parameters
        given = {name: self.value(value) for each in others for name, value in each.items()}
        return self.value(file), given

    def remappings(self, package):
        return {name: self.value(value) for name, value in self.node(package).remappings}

    def _visit(self, actions):
        for each in actions or ():
            condition = getattr(each, 'condition', None)
            if condition is None or condition.evaluate(self):
                self.actions.append(each)
                self._carry_out(each)

    def _carry_out(self, action):
        if action.kind == 'DeclareLaunchArgument' and action.name not in self.configurations:
            assert action.default_value is not None, f'{action.name} must be given'
            self.configurations[action.name] = action.default_value
        if action.kind == 'OpaqueFunction':
            self._visit(action.function(self))
        if action.kind == 'IncludeLaunchDescription':
            self.configurations.update(action.launch_arguments)
            self._visit(description_in(Path(action.positional[0].path)))
