"""When a picture is at rest: thresholds on the number of frames since the last change, for decisions of the host.

Those of shaders are in convergence.slang.
"""

UNTESTED_FROM = 16
"""Frames after which histories are no longer tested against new samples: every change has reached them by then."""
RELIT_FOR = 8
"""Frames after a change of lights in which indirect light keeps short histories."""
AT_REST_AFTER_RELIT = 24
"""Frames after a change of lights until a picture may come to rest: indirect light follows until then."""
CORRECTION_FROM = 32
"""Frames after which reflections converge to the mean of each pixel's own rays."""
UNFILTERED_FROM = 256
"""Frames after which no pixel shows filtered stochastic light: past UNFILTERED_AT_LAST of convergence.slang, with a
margin for pixels whose history began later."""
QUIET_FROM = 56
"""The same in pictures with few noisy pixels, past UNFILTERED_BY of convergence.slang."""
NOISY_PICTURE = 0.05
"""Fraction of pixels with noisy light above which a picture waits for UNFILTERED_FROM."""
COMPLETE_FROM = 128
"""Frames after which surfels, translucency and histories of stochastic light have converged and stay as they are."""
