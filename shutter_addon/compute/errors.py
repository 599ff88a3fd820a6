"""What can be wrong with a device."""


class NoDeviceError(RuntimeError):
    """The device is not here, or has no room; the message is one sentence for the user."""
