"""Submissions to a device, and waits for them during which Python's other threads go on."""

import time

import slangpy as spy

_POLL = 2e-4
"""Seconds between looks whether the device has finished."""


class Submissions:
    """Submits what is recorded, and waits for it.

    SlangPy's own waits hold the lock of Python's interpreter: meanwhile a server would neither read messages nor encode
    the picture before.
    """

    def __init__(self, device: spy.Device, polls: bool) -> None:
        """`polls`: whether waits are polls; a processor that renders has no time for other threads."""
        self._device, self._polls = device, polls
        self._newest = 0

    def submit(self, encoder: spy.CommandEncoder) -> int:
        """Submit what an encoder has recorded; returns the submission's number."""
        self._newest = self._device.submit_command_buffer(encoder.finish())
        return self._newest

    def wait(self, submission: int) -> None:
        """Wait until the device has finished a submission, and those before it."""
        self._poll(submission)
        self._device.wait_for_submit(submission)

    def wait_for_all(self) -> None:
        """Wait until the device has nothing to do."""
        self._poll(self._newest)
        self._device.wait_for_idle()

    def _poll(self, submission: int) -> None:
        while self._polls and not self._device.is_submit_finished(submission):
            time.sleep(_POLL)
