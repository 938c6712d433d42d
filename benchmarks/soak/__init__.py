"""Hold the node to a robot's working day: large clouds for minutes, overload, faults."""
