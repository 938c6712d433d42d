"""The family of errors that idem_ros raises for what a caller or a user did."""


class IdemError(Exception):
    """Root of the family: a message names what was given, what is wrong, what would be right."""


class InvalidCloud(IdemError):
    """Points that no registration can use: wrong shape, not numbers, or none of them finite."""


class InvalidTransform(IdemError):
    """A matrix that is not a rigid transform."""


class InvalidConfig(IdemError):
    """A parameter outside its range, or parameters that contradict each other."""
