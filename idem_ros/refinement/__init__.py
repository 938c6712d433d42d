"""From a pair of messages to a refined transform, live and offline."""
