"""What a renderer tells of its frames, and the passes that users insert into them."""

from functools import cached_property
from weakref import ref

from pica.frame.context import Size
from pica.frame.effect import Effect
from pica.graph.description import GraphDescription
from pica.renderer.frame_plan import FramePlan
from pica.renderer.insertion import Declare, Insertion, checked_insertion
from pica.renderer.stages import Stages
from pica.renderer.view import View
from pica.rendering.closing import Closing, synchronized
from pica.rhi.device import Device
from pica.rhi.fair_lock import SeveralLocks
from pica.tracing.ray_buffers import Tracer


class RendererFrames(Closing):
    """The views of a renderer and how they make frames: the first view stands for all where they are alike."""

    _views: list[View]
    _others: list[Device]
    """Devices that help to trace rays."""

    @cached_property
    def _lock(self) -> SeveralLocks:
        """Of all its devices."""
        return SeveralLocks(device.lock for device in (self.device, *self._others))

    @property
    def views(self) -> int:
        """How many cameras it renders in a call."""
        return len(self._views)

    @property
    def _stages(self) -> Stages:
        return self._views[0].stages

    @property
    def _frame_plan(self) -> FramePlan:
        return self._views[0].plan

    @property
    def device_name(self) -> str:
        """The adapter that renders; several with " and " between them."""
        return " and ".join(device.name for device in (self.device, *self._others))

    @property
    def pending_shaders(self) -> int:
        """How many shader programs are still to be made, as of the newest frame, for material types that came."""
        return self.view.pending_programs

    @property
    def single_lights(self) -> list[str]:
        """Names of the lights that have a shadow ray of their own, strongest first."""
        return self._stages.slots.single_lights

    @property
    def host_seconds(self) -> float:
        """The host's time to record and submit the newest frame of all views."""
        return self._views[0].frames.host_seconds

    @property
    def render_size(self) -> Size:
        """At which all up to antialiasing works; `size` is that of the pictures."""
        return self._views[0].frames.size

    @property
    def effects(self) -> list[Effect]:
        """The active stages, in the order of the frame."""
        return self._stages.effects

    @property
    def tracer(self) -> Tracer | None:
        """The tracer of ray buffers; None if ray tracing pipelines trace."""
        return self._stages.tracer

    @property
    def missing_aovs(self) -> dict[str, str]:
        """AOVs of effects that are off, with the effect's name."""
        return self._stages.missing_aovs

    @property
    def debug_aovs(self) -> tuple[str, ...]:
        """Names of the debug AOVs that `advance` can capture, as of the newest frame; none before the first."""
        return self._frame_plan.debug_aovs

    @property
    @synchronized
    def ray_counters(self) -> tuple[str, ...]:
        """Names, "rays.PASS", of the numbers of rays that `advance` can capture, as `debug_aovs`."""
        return self._frame_plan.ray_counters

    @property
    @synchronized
    def graph(self) -> GraphDescription:
        """The passes of the newest frame with what they read and write, their times and their memory. Waits for the
        device. Of the first view. Raises PicaError before the first frame."""
        with self.device.lock:
            return self._frame_plan.describe()

    @synchronized
    def insert(self, declare: Declare, after: str, *, name: str | None = None) -> Insertion:
        """Insert passes of your own into the frame, from the next one on (docs/guide/own-passes.md).

        `declare(graph, signals)` is called whenever the frame is declared, right after the stage `after`: "gbuffer",
        "shadows", "ambient_occlusion", "lighting", "global_illumination", "translucency", "reflections", "composite",
        "transparency", "antialiasing" or "post". It adds passes to the graph, and may replace the radiance, the picture
        or the display among the signals, or append to the parts of the light. `name`: of the effect, by default that
        of `declare`.
        Raises PicaError for an unknown stage, or a name in use.
        """
        taken = {"scene", "shared", *(effect.name for effect in self.effects)}
        taken.update(insertion.name for insertion in self._frame_plan.inserted)
        insertion = checked_insertion(declare, after, name, taken, ref(self))
        for view in self._views:
            view.plan.inserted.append(insertion)
        self.renew_frame()
        return insertion

    @synchronized
    def remove(self, insertion: Insertion) -> None:
        """Remove an `insert`. Does nothing if it is removed already."""
        if insertion in self._frame_plan.inserted:
            for view in self._views:
                view.plan.inserted.remove(insertion)
            self.renew_frame()

    @synchronized
    def renew_frame(self) -> None:
        """Declare the frame again, with a new picture: inserted passes are others. Histories of effects stay."""
        for view in self._views:
            view.renew()
