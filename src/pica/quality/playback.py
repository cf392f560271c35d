"""Sequences rendered frame by frame."""

from collections.abc import Iterable

from pica.images.output import Frame
from pica.quality.sequences import Sequence
from pica.renderer import Renderer
from pica.rendering.arguments import Progress


def last_frame(renderer: Renderer, play: Sequence, frames: Iterable[int], progress: Progress | None = None) -> Frame:
    """The last of these frames of a sequence, each rendered once."""
    numbers = list(frames)
    for done, number in enumerate(numbers):
        frame = renderer.render(1, camera=play(number), aovs=())
        if progress is not None:
            progress(done + 1, len(numbers))
    return frame
