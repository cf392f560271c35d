"""Ray effects: written once, run as ray tracing pipelines or as ray buffers around a tracer such as Embree."""
