"""Messages of Slang-RHI's validation and, if its layer is installed, of Khronos'. PICA_VALIDATE=1 enables both."""

import os
import sys
from functools import cache

import slangpy as spy

KNOWN = {
    "is not supported by this layer": "the installed layer is older than the driver",
    "includes a structure with unknown VkStructureType": "likewise",
    "Invalid source language operand": "nor does it know that SPIR-V is made from Slang",
    "no buffer is associated with pCallableShaderBindingTable": "layers of before May 2023 take a table of size 0 for "
    "a fault (KhronosGroup/Vulkan-ValidationLayers, issue 5635)",
    "Failed to create pipeline from cache": "NVIDIA's driver refuses what it kept of a ray tracing pipeline that was "
    "made while another one lived, and makes it anew (docs/measurements/startup.md, Material types)",
}
"""Messages without relevance for pica, by a part of their text, and why."""


def asked() -> bool:
    """Whether devices opened from now on are validated; `said` returns their messages."""
    enabled = os.environ.get("PICA_VALIDATE", "") not in ("", "0")
    if enabled:
        _listener()
    return enabled


def said() -> list[str]:
    """The messages since the last call that are not KNOWN, each once, in one line with its source: "layer:" is
    Slang-RHI, "driver:" Khronos."""
    listener = _listener()
    messages, listener.messages = listener.messages, {}
    return list(messages)


class _Listener(spy.LoggerOutput):
    """Replaces SlangPy's own output, which writes all warnings, even KNOWN ones, to stdout."""

    def __init__(self) -> None:
        super().__init__()
        self.messages: dict[str, None] = {}

    def write(self, level: spy.LogLevel, name: str, msg: str) -> None:
        if any(part in msg for part in KNOWN):
            return
        if name == "rhi" and level in (spy.LogLevel.warn, spy.LogLevel.error, spy.LogLevel.fatal):
            self.messages[" ".join(msg.split())] = None
        print(f"{level.name} ({name}): {msg}", file=sys.stderr)


@cache
def _listener() -> _Listener:
    listener = _Listener()
    spy.Logger.get().remove_all_outputs()
    spy.Logger.get().add_output(listener)
    return listener
