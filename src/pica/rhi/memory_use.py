"""Bytes of device memory in use."""

from dataclasses import dataclass


@dataclass(eq=False)
class MemoryUse:
    """Bytes allocated and not yet released, and their peak."""

    now: int = 0
    peak: int = 0

    def count(self, size: int) -> None:
        """Book `size` bytes as allocated, or, if negative, as released."""
        self.now += size
        self.peak = max(self.peak, self.now)

    def release(self, scope: "MemoryUse") -> None:
        """Book all memory of a scope as released."""
        self.now -= scope.now
