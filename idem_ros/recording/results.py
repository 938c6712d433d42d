"""What a replay found as a recording: the messages of the live node, and how it was made."""

from heapq import merge

from idem_ros.recording.embedded import METADATA, RECORD
from idem_ros.recording.messages import diagnostics_message, transform_message
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.diagnostics import level, message_of, refinement_values

DIAGNOSTICS_TOPIC = '/diagnostics'
NODE = '/idem_node'
TRANSFORM_TOPIC = f'{NODE}/transform'


def result_messages(frames):
    """Yield (topic, log time, message) of each `Frame`: its transform, then its diagnostics.

    Log times are those of the inputs, pushed apart where they coincide: of equal ones no format
    keeps the order.
    """
    free = 0
    for frame in frames:
        log_time = max(free, frame.log_time)
        free = log_time + 2
        refinement = frame.refinement
        result, stamp = refinement.result, refinement.instant
        yield (
            TRANSFORM_TOPIC,
            log_time,
            transform_message(
                result.T_target_source, stamp, refinement.target_frame, refinement.source_frame
            ),
        )
        # a replay drops no input
        values = refinement_values(refinement, dropped=0)
        text = message_of(refinement)
        yield (
            DIAGNOSTICS_TOPIC,
            log_time + 1,
            diagnostics_message(NODE, 'registration', level(refinement), text, values, stamp),
        )


def write_result(path, frames, made_by, record, clouds=()):
    """Write a result: its messages, how it was made as metadata, all numbers as an attachment.

    Args:
        path: the .mcap file.
        frames: see `result_messages`.
        made_by: {key: text}.
        record: the JSON, a binary file.
        clouds: (topic, log time, message) to stand among them, in the order of their log times.

    Raises:
        UnwritableFile: `path` cannot be written.
    """
    write_mcap(
        path,
        merge(clouds, result_messages(frames), key=lambda each: each[1]),
        metadata={METADATA: made_by},
        attachments={RECORD: ('application/json', record)},
    )
