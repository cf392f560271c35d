"""An effect of one's own, outline.slang: dark lines where an object ends or a surface turns.

python examples/outline.py cornell.png
"""

import argparse
from pathlib import Path

import slangpy as spy

import pica
from pica.graph import FrameGraph, update, write


class Outline:
    """Takes the light away where lines are; the AOV "outline" is 1 there."""

    name = "outline"

    def __init__(self, renderer: pica.Renderer, strength: float) -> None:
        self._pass = pica.compute_pass(renderer.device, Path(__file__).with_name("outline.slang"))
        self._strength = strength

    def __call__(self, graph: FrameGraph, signals: pica.Signals) -> None:
        """Add its pass to the frame."""
        edges = graph.texture("edges", spy.Format.r32_float)
        graph.add(
            self._pass,
            graph.grid,
            radiance=update(signals.radiance),
            edges=write(edges),
            strength=self._strength,
        )
        graph.offer("outline", (edges,), lambda values: values)


def main() -> None:
    """Render a scene with outlines."""
    parser = argparse.ArgumentParser(description="An effect of one's own: outlines.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=32)
    parser.add_argument("--preset", default="quality")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))

    settings = pica.Settings.preset(arguments.preset)
    with pica.Renderer(pica.scenes.machine_world(), size=(width, height), settings=settings) as renderer:
        renderer.insert(Outline(renderer, strength=0.95), after="composite")  # antialiasing then smooths the lines
        renderer.render(arguments.frames).save(arguments.output)


if __name__ == "__main__":
    main()
