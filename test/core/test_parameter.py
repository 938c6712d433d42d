"""Values of parameters, held to what their fields say."""

from dataclasses import fields

import numpy as np
import pytest

from idem_ros.commands.options import TITLES
from idem_ros.core import InvalidConfig, RegistrationConfig
from idem_ros.core.parameter import parameter_name

EVERY = [(config, each) for config in TITLES for each in fields(config)]


@pytest.mark.parametrize('value', [object(), -1, float('nan'), 'no such word'])
@pytest.mark.parametrize(('config', 'each'), EVERY, ids=lambda what: getattr(what, 'name', ''))
def test_a_value_that_no_parameter_can_have_is_refused_by_its_name(config, each, value):
    if isinstance(value, str) and each.type is str and 'choices' not in each.metadata:
        pytest.skip('any text will do')
    with pytest.raises(InvalidConfig, match=parameter_name(each)):
        config(**{each.name: value})


def test_a_scalar_of_numpy_becomes_one_of_python():
    config = RegistrationConfig(voxel_size=np.float32(0.5), threads=np.int64(2))
    assert (type(config.voxel_size), type(config.threads)) == (float, int)
