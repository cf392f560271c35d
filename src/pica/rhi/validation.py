"""What Slang-RHI's validation says and, where its layer is installed, Khronos'. PICA_VALIDATE=1 switches both on."""

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
"""What says nothing about pica, by a part of the message, and why."""


def asked() -> bool:
    """Whether devices that are opened now are to be validated; `said` tells what was said then."""
    wanted = os.environ.get("PICA_VALIDATE", "") not in ("", "0")
    if wanted:
        _listener()
    return wanted


def said() -> list[str]:
    """What was said since the last call, and is not KNOWN, each once in one line that tells who said it: "layer:" is
    Slang-RHI, "driver:" Khronos."""
    listener = _listener()
    messages, listener.messages = listener.messages, {}
    return list(messages)


class _Listener(spy.LoggerOutput):
    """Takes the place of SlangPy's own output, which writes warnings to stdout, KNOWN ones too."""

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
