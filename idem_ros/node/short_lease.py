"""A short lease for the node: who publishes to it forgets it soon after it was killed.

Fast DDS holds a process for alive for 20 s after its last announcement. Until then publishers go
on sending to the ports in shared memory of a killed node, wait there for locks that it held, and
take them for dead and remove them while the next node listens. Clouds then reach that one in part
only; and when a publisher drops a cloud that a reliable reader has in part, the reader of Fast DDS
2.14 keeps a sample that is gone, and its next take never returns.
"""

import os
from pathlib import Path

from idem_ros.files.installed_file import installed_file

VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
IN_THE_WORKING_FOLDER = 'DEFAULT_FASTRTPS_PROFILES.xml'  # Fast DDS reads it, too
PROFILE = 'config/fastdds_short_lease.xml'
RANGE, LOCALHOST_ONLY = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOCALHOST_ONLY'


def prefer_short_lease() -> None:
    """Have Fast DDS take the short lease, unless the user gave it a profile.

    Only where discovery stays on this machine: a network may lose announcements for longer. To be
    called before rclpy is initialized.
    """
    is_local = os.environ.get(RANGE) == 'LOCALHOST' or os.environ.get(LOCALHOST_ONLY) == '1'
    is_given = os.environ.get(VARIABLE) or Path(IN_THE_WORKING_FOLDER).exists()
    if is_local and not is_given and (profile := installed_file(PROFILE)):
        os.environ[VARIABLE] = str(profile)
