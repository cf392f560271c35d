"""The frame's graph: declared when its structure changes, otherwise replayed."""

from collections.abc import Callable
from typing import Any

from pica.denoising.denoiser import Denoiser
from pica.errors import PicaError
from pica.frame.aovs import texels
from pica.frame.context import FrameSequence
from pica.gpu_scene.view import SceneView
from pica.graph.description import GraphDescription, describe
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan, part_of
from pica.many_views.merged_plans import MergedFrames
from pica.programs.scene_features import COATS, LOBES, supported_features
from pica.renderer.frame import Signals, declare
from pica.renderer.insertion import Insertion
from pica.renderer.stages import Stages
from pica.rhi.device import Device


class FramePlan:
    """One renderer's compiled graph, and its memory."""

    def __init__(self, device: Device, merged: MergedFrames | None = None) -> None:
        """`merged`: as View's."""
        self._device, self._merged = device, merged
        self.memory = Memory(device.memory_scope())
        self._label_memory: Memory | None = None
        self._plan: Plan | None = None
        self._labels: Plan | None = None
        self._structure: Any = None
        self._requested: frozenset[str] = frozenset()
        self._label_structure: Any = None
        self.inserted: list[Insertion] = []
        """Inserted passes, in this order after their stages."""
        self.signals: Signals
        """The outputs of the newest plan's stages."""

    def outdate(self) -> None:
        """Stages are others: declare the frame again."""
        self._structure = self._label_structure = None

    def of(
        self,
        stages: Stages,
        frames: FrameSequence,
        view: SceneView,
        select: Callable[[Plan], frozenset[str]],
        denoiser: Denoiser | None = None,
        last: bool = False,
    ) -> tuple[Plan, frozenset[str]]:
        """The plan for a frame of the current scene, and the captures: `select` chooses from a plan's offers.

        All programs are made before a plan's first frame.
        """
        requested = select(self._plan).intersection(self._requested) if self._plan is not None else frozenset()
        while True:
            structure = self._structure_of(stages, frames, view, denoiser, last)
            if self._plan is None or (structure, requested) != (self._structure, self._requested):
                self._structure, self._requested = None, requested  # a failed declaration is retried
                self._plan = self._declare(stages, frames, view, denoiser, last)
                self._structure = structure
                self._labels = self._label_memory = None
                if self._merged is not None and self._merged.takes([self._plan]):
                    self._merged.expect(self._plan)
                view.make_programs()  # which may find some that are made for more features
                continue
            names = select(self._plan)
            lacking = self._plan.lacks(names)
            if not lacking:
                return self._plan, names
            requested |= lacking

    def of_gbuffer(
        self, stages: Stages, frames: FrameSequence, view: SceneView, select: Callable[[Plan], frozenset[str]]
    ) -> tuple[Plan, frozenset[str]]:
        """A plan with the passes that fill the G-buffer alone; only their programs are needed."""
        structure = self._gbuffer_structure(frames, view)
        if self._plan is not None and self._structure is not None and self._structure[0] == structure:
            names = select(self._plan)
            if not self._plan.lacks(names):
                return self._plan, names
        if self._labels is None or self._label_structure != structure:
            self._label_structure = structure
            self._label_memory = self._label_memory or Memory(self._device.memory_scope())
            graph = self._graph(self._label_memory, frames, frozenset(stages.gbuffer.aov_names))
            stages.gbuffer(graph, view)
            self._labels = Plan(graph)
        return self._labels, select(self._labels)

    @property
    def debug_aovs(self) -> tuple[str, ...]:
        """Names of the newest plan's debug AOVs, sorted."""
        return self._names_of("debug")

    @property
    def ray_counters(self) -> tuple[str, ...]:
        """Names of the newest plan's numbers of rays, sorted."""
        return self._names_of("rays")

    def _names_of(self, kind: str) -> tuple[str, ...]:
        return () if self._plan is None else tuple(sorted(self._plan.names_of(kind)))

    def describe(self) -> GraphDescription:
        """The newest plan. Raises PicaError before the first frame."""
        if self._plan is None:
            raise PicaError("graph: there is none before the first frame; call render or prepare")
        profiler = self._device.profiler
        profiler.flush()
        serial = self._plan.serial
        own = (times for times in reversed(profiler.by_owner) if any(part_of(serial, owner) for owner in times))
        return describe(self._plan, next(own, {}), profiler.copied)

    def _structure_of(
        self, stages: Stages, frames: FrameSequence, view: SceneView, denoiser: Denoiser | None, last: bool
    ) -> tuple[Any, ...]:
        """Everything that determines the passes and the sizes of their textures."""
        gathers = denoiser, last and denoiser is not None
        by_pixel = stages.translucency is not None and stages.translucency.works_by_pixel(view)
        light = stages.slots.layout, view.transparent, view.mirrors, by_pixel
        return self._gbuffer_structure(frames, view), light, gathers, frames.has_aperture

    def _gbuffer_structure(self, frames: FrameSequence, view: SceneView) -> tuple[Any, ...]:
        features = supported_features(view.material_types)
        return (
            frames,
            frames.size,
            frames.output_size,
            COATS in features,
            LOBES in features,
            view.shows_glass,
            view.shows_rough_glass,
            view.shows_layers,
            view.translucent,
        )

    def _graph(self, memory: Memory, frames: FrameSequence, requested: frozenset[str]) -> FrameGraph:
        return FrameGraph(memory, frames.size, frames.output_size, frames.block, frames.half_block, requested)

    def _declare(
        self, stages: Stages, frames: FrameSequence, view: SceneView, denoiser: Denoiser | None, last: bool
    ) -> Plan:
        graph = self._graph(self.memory, frames, self._requested)
        self.signals = signals = Signals(view, stages.slots)
        for stage in declare(stages, graph, signals, denoiser, last, frames.has_aperture):
            for insertion in self.inserted:
                if insertion.after == stage:
                    insertion.declare(graph, signals)
        graph.offer("color", (signals.picture,), texels(3))
        graph.offer("display", (signals.display,), texels(3))
        return Plan(graph)
