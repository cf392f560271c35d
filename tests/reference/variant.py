"""Mitsuba 3 and Dr.Jit on the CPU, with an LLVM that works; tests that import this are skipped without them."""

import glob
import os

import pytest

dr = pytest.importorskip("drjit", reason="Mitsuba is not installed: pip install mitsuba")
mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install mitsuba")

# Dr.Jit takes the first LLVM it finds; before 17 it fails on recent processors.
_LIBRARIES = [path for version in range(30, 16, -1) for path in glob.glob(f"/usr/lib/*/libLLVM*{version}*")]
if "DRJIT_LIBLLVM_PATH" not in os.environ and _LIBRARIES:
    os.environ["DRJIT_LIBLLVM_PATH"] = _LIBRARIES[0]
mi.set_variant("llvm_ad_rgb")
try:
    dr.eval(mi.Float(1) + mi.UInt32(1))
except RuntimeError as fault:
    pytest.skip(f"Mitsuba finds no usable LLVM, install libllvm19: {fault}", allow_module_level=True)
