"""Files as `idem replay --json` writes them, with numbers of the test's own."""

import json
from pathlib import Path


def write_result(path, statuses=(), bag='run.mcap', refused=0, dropped=0, unpaired=0, **columns):
    """Write a result: of each column, frame i has the i-th number (None: unknown)."""
    count = max(len(statuses), *map(len, columns.values())) if columns else len(statuses)
    frames = [
        {
            'stamp_ns': (i + 1) * 10**8,
            'source_frame': 'lidar',
            'T_guess': [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
            'status': statuses[i] if statuses else 'converged',
            **{name: values[i] for name, values in columns.items()},
        }
        for i in range(count)
    ]
    counts = {'frames': count, 'refused': refused, 'dropped': dropped, 'unpaired': unpaired}
    Path(path).write_text(json.dumps({'bag': bag, 'frames': frames, 'summary': counts}))
