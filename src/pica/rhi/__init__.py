"""The thin layer over SlangPy: devices, acceleration structures, pipelines, ray effects, the profiler."""
