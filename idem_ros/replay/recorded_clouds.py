"""The clouds of a replay as its recording has them, to stand beside what was found."""

from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.messages import recorded_cloud
from idem_ros.recording.reader import open_recording


def recorded_clouds(replayed):
    """Yield (topic, log time, message) of what a `Replay` refined, as far as its last frame.

    Sources that were not refined are left out; of a target from a file there is no message.
    """
    target = replayed.topics.target
    topics = [topic for topic in (target, replayed.topics.source) if topic]
    refined = {frame.refinement.stamp for frame in replayed.frames}
    last = max((frame.log_time for frame in replayed.frames), default=0)
    with open_recording(replayed.path) as recording:
        for topic, log_time, message in recording.messages(topics):
            if log_time > last:
                return
            if topic == target or stamp_ns(message) in refined:
                yield topic, log_time, recorded_cloud(message)
