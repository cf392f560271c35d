"""The thin layer over SlangPy: devices, passes, tables, acceleration structures, the profiler."""
