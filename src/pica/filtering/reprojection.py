"""Where each pixel was in the previous frame, found once a frame for all effects."""

import slangpy as spy

from pica.filtering.convergence import RELIT_FOR, UNTESTED_FROM
from pica.frame.context import FrameContext
from pica.graph.graph import FrameGraph
from pica.graph.resources import Block, Lifetime, Texture, write
from pica.rhi.device import Device

_NEVER = 1e9


class Reprojection:
    """The block `reprojection` of filtering/temporal.slang."""

    def __init__(self, device: Device) -> None:
        self._find_cut = device.compute("filtering/cut.slang")
        self._find = device.compute("filtering/reprojection.slang")
        self.block: Block
        self.found: Texture
        """(width, height, r32_uint) words as filtering/previous_surface.slang has them."""
        self.cut: Texture
        """(1, 1, r32_uint) 1: the camera has cut; of a frame in which it has moved."""
        self.unchanged = 0
        """Frames since the last change, as of the frame that is being recorded."""

    def __call__(self, graph: FrameGraph) -> "Reprojection":
        """Reproject the surfaces of the G-buffer."""
        with graph.scope("reprojection"):
            history = graph.history("reprojection", {"found": spy.Format.r32_uint})
            state = history.state
            self.cut = cut = graph.texture("cut", spy.Format.r32_uint, (1, 1), lifetime=Lifetime.KEPT)

            def count(frame: FrameContext) -> None:
                self.unchanged = 0 if frame.changed else self.unchanged + 1

            def moved(frame: FrameContext) -> bool:
                return frame.camera_moved and state.precedes(frame)

            graph.record("count unchanged frames", count)
            graph.add(self._find_cut, (1, 1, 1), when=moved, cut=write(cut))
            graph.add(
                self._find,
                graph.grid,
                unknown=lambda frame: int(state.empty),
                cut=cut,
                moved=lambda frame: int(frame.camera_moved and not state.empty),
                unsettled=lambda frame: int(frame.changed_lights),
                **history.swap(),
            )
            self.found = history["found"]
            self.block = graph.block(
                "filtering/temporal.slang",
                "reprojection",
                found=self.found,
                relit=lambda frame: int(frame.since_relit < RELIT_FOR),
                unchanged=lambda frame: float(self.unchanged if self.unchanged < UNTESTED_FROM else _NEVER),
            )
            graph.offer("debug.reprojection.found", (self.found,), lambda words: words)
        return self
