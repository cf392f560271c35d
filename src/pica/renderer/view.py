"""One view of a renderer: a camera's data of the scene, stages with their histories, and frame graph."""

from collections.abc import Callable, Sequence
from typing import Any

import slangpy as spy

from pica.denoising.denoiser import Denoiser
from pica.frame.context import Batch, FrameContext, FrameSequence, Size
from pica.frame.relighting import Relighting
from pica.gpu_scene.view import SceneView
from pica.graph.plan import Plan, newest
from pica.images.lut import Lut
from pica.light_map.light_map import LightMap
from pica.many_views.merged_plans import MergedFrames
from pica.renderer.frame_plan import FramePlan
from pica.renderer.stages import EVERY_GROUP, Stages
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings
from pica.tracing.fallbacks import traces
from pica.tracing.shared_tracer import SharedTracer

Select = Callable[[Plan], frozenset[str]]
"""Chooses a frame's captures, of what a plan offers."""
_SEEDS = 1 << 31


class View:
    """What a camera needs from frame to frame.

    Views of one scene share its copy on the device, its programs, and what their leader keeps for all (Stages).
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        size: Size,
        settings: Settings,
        light_map: LightMap | None,
        lut: Lut | None,
        number: int,
        leader: "View | None",
        others: Sequence[Device] = (),
        merged: MergedFrames | None = None,
    ) -> None:
        """`number`: counts the views of a renderer; the seed of their noise is that of the settings plus it. `leader`:
        the first view of the same scene; None: this one is. `others`: devices that help to trace rays. `merged`:
        records the frames of all views."""
        self.leader = leader
        self._device, self._settings, self._number = device, settings, number
        self.scene = SceneView(device, scene, settings)
        self.frames = self._make_frames(size)
        leading = leader.stages if leader is not None else None
        self._shared = SharedTracer(device, self.scene, others, settings) if others and traces(device) else None
        self.stages: Stages = Stages(device, settings, self.scene, light_map, lut, leading, self._shared)
        self.plan = FramePlan(device, merged)
        self._relighting = Relighting()

    def sync(self, wait: bool) -> None:
        """Collect the scene's changes before a frame begins; `wait` as SceneView.sync, which devices that share rays
        always do, as all must show the same."""
        self.scene.sync(wait or self._shared is not None)
        if self._shared is not None:
            self._shared.sync()

    def begin(self, camera: Camera, batch: Batch, jittered: bool, follows: bool = False) -> FrameContext:
        """A frame in which the scene is up to date. `follows`: as SceneView.update."""
        if self._shared is not None:
            self._shared.begin_frame(camera)
        frame = self.frames.begin(camera, jittered, batch)
        frame.changed_scene = self.scene.update(frame, camera, follows)
        frame.changed |= frame.changed_scene
        frame.changed_lights = self.scene.lights_changed
        frame.since_relit = self._relighting.count(frame.changed_lights, frame.first)
        if frame.changed_lights and not frame.first:
            self.frames.note_changed_lights()
        return frame

    def plan_for(self, frame: FrameContext, select: Select, denoiser: Denoiser | None, last: bool) -> Plan:
        """The frame's passes. `last`: `denoiser` finishes its picture."""
        self.stages.slots.update(self.scene.lights)
        plan, frame.requested = self.plan.of(self.stages, self.frames, self.scene, select, denoiser, last)
        return plan

    def gbuffer_plan_for(self, frame: FrameContext, select: Select) -> Plan:
        """A plan of which those of the G-buffer are to be recorded alone."""
        plan, frame.requested = self.plan.of_gbuffer(self.stages, self.frames, self.scene, select)
        return plan

    def without_denoiser(self) -> None:
        """Declare the frame without the denoiser, whose inputs belong to a picture that is finished."""
        self.plan.of(self.stages, self.frames, self.scene, lambda plan: frozenset())

    def inputs(self) -> dict[str, Any]:
        """Inputs of the newest frame's effects, by their names in shaders."""
        return {
            "frame": self.frames.block,
            "gbuffer": self.plan.signals.gbuffer.block.parameters,
            "scene": self.scene,
            "lightSlots": self.stages.slots,
        }

    def textures(self) -> dict[str, spy.Texture]:
        """The newest frame's G-buffer and pictures."""
        signals = self.plan.signals
        textures = {**signals.gbuffer.textures, "color": signals.picture, "display": signals.display}
        return {name: newest(texture) for name, texture in textures.items()}

    def renew(self) -> None:
        """Declare the frame again, with a new picture. Histories of effects stay."""
        self.plan.outdate()
        self.stages.antialiasing.restart()

    def drop_histories(self) -> None:
        """Discard all that earlier frames have left."""
        self.plan.memory.reset()
        self.stages.reset()

    def reset(self, frame: int = 0) -> None:
        """The next frame is the first again, with this number."""
        self.frames.reset(frame)
        self.drop_histories()

    def resize(self, size: Size) -> None:
        """Frames of another size, without history."""
        self.frames.resize(size)
        self.drop_histories()

    def configure(self, settings: Settings) -> None:
        """Follow other settings, which run on the device. Unaffected stages keep their histories."""
        self.scene.configure(settings)
        if self._shared is not None:
            self._shared.configure(settings)
        before, self._settings = self._settings, settings
        changed = before.changed_groups(settings)
        if before.antialiasing.upscale != settings.antialiasing.upscale:
            changed = EVERY_GROUP  # all works at another size
        if changed & {"seed", "antialiasing"}:
            self.frames = self._make_frames(self.frames.output_size)
        self.plan.memory.reset(self.stages.follow(settings, changed))
        self.plan.outdate()
        if changed & {"seed", "rays", "visibility", "antialiasing"}:
            self.reset()  # the history of the G-buffer or the camera is invalid
        elif changed - {"geometry", "post"}:
            self.stages.antialiasing.restart()

    def _make_frames(self, size: Size) -> FrameSequence:
        settings = self._settings
        return FrameSequence(self._device, size, (settings.seed + self._number) % _SEEDS, settings.antialiasing.upscale)
