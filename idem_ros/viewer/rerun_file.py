"""A `Scene` as a recording of rerun, for its viewer: the solve is a timeline."""

import numpy as np

TARGET, SOURCE, FREE = (31, 111, 180), (209, 73, 91), (255, 198, 26)
RAMP = np.array([(43, 95, 168), (242, 242, 242), (200, 16, 46)], float)  # agreeing to not
STEP = 'step'  # of the solve; 0 is the guess


def write_rerun(path, scene):
    """Write a `Scene` into an .rrd file.

    Entities: `target`, `source` (which moves along the timeline `step`), `q_i` (what q_tot is of,
    with what each adds to it), `free/N` (motions that nothing determines) and `verdict`.

    Raises:
        ImportError: rerun is not installed.
    """
    import rerun as rr  # pyright: ignore[reportMissingImports]  # of the extra

    view = scene.view
    stream = rr.RecordingStream('idem_show')
    stream.save(path)
    stream.log('/', rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    stream.log('target', rr.Points3D(view.target, colors=TARGET), static=True)
    stream.log('source', rr.Points3D(view.source, colors=SOURCE), static=True)
    stream.log('q_i', rr.Points3D(view.means, colors=_colours(view.q)), static=True)
    for k, motion in enumerate(view.free):
        vector, said = _arrow(motion, view.extent)
        given = {'origins': view.poses[-1][:3, 3], 'colors': FREE, 'labels': said}
        stream.log(f'free/{k}', rr.Arrows3D(vectors=vector, **given), static=True)
    text = '\n'.join(f'- **{name}**: {value}' for name, value in scene.values.items())
    stream.log('verdict', rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    for k, (name, pose) in enumerate(zip(view.names, view.poses, strict=True)):
        stream.set_time(STEP, sequence=k)
        stream.log('source', rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        stream.log('said', rr.TextLog(name))
    stream.disconnect()  # what is buffered is written


def _arrow(motion, extent):
    """Return (3,) along a translation, or the axis of a turn, and which of the two it is."""
    move, turn = motion[:3], motion[3:]
    is_move = np.linalg.norm(move) > np.linalg.norm(turn) * extent
    along = move if is_move else turn
    said = 'free along' if is_move else 'free about'
    return 0.15 * extent * along / np.linalg.norm(along), said


def _colours(q):
    highest = np.percentile(q, 98) if len(q) else 1.0
    share = np.clip(q / (highest or 1.0), 0.0, 1.0)
    steps = np.linspace(0.0, 1.0, len(RAMP))
    return np.column_stack([np.interp(share, steps, each) for each in RAMP.T]).astype(np.uint8)
