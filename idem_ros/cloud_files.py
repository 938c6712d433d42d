"""Where `read_cloud` has always been imported from; the readers are in `idem_ros.files`."""

from idem_ros.files.cloud_file import READERS, UnreadableCloud, read_cloud

__all__ = ['READERS', 'UnreadableCloud', 'read_cloud']
