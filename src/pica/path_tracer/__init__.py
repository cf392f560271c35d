"""The reference: an unbiased path tracer over the same scene, materials and lights."""
