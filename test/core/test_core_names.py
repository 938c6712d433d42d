import ast
import subprocess
import sys
from pathlib import Path

import idem_ros.core


def test_the_core_shows_its_names_before_they_are_loaded():
    code = (
        'import idem_ros.core as core, sys; print(*dir(core)); assert "numba" not in sys.modules'
    )
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert set(idem_ros.core.__all__) <= set(run.stdout.split())


def test_type_checkers_are_told_of_each_name_where_it_is():
    tree = ast.parse(Path(idem_ros.core.__file__).read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    told = {name.name: each.module for each in block.body for name in each.names}
    loaded = {name: f'idem_ros.core.{room}' for name, room in idem_ros.core._LOADED_LATER.items()}
    assert told == loaded
