import json

import pytest

from idem_ros.results.result_file import record_text

FRAMES = [{'T': [[1.0, -0.0], []], 'why': 'a\nb "c" \u00e9', 'none': None}, {}]


@pytest.mark.parametrize('frames', [FRAMES, FRAMES[:1], []])
def test_the_text_is_that_of_json_and_the_frames_may_come_one_by_one(frames):
    record = {'bag': 'a.mcap', 'frames': frames, 'summary': {'n': {'p90': 1e-300}}, 'notes': []}
    text = ''.join(record_text({**record, 'frames': iter(frames)}))
    assert text == json.dumps(record, indent=1) + '\n'


def test_a_number_that_json_has_not_is_refused():
    with pytest.raises(ValueError, match='JSON'):
        list(record_text({'frames': [{'q_tot': float('nan')}]}))
