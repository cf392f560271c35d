"""A compiled graph as plain values: for programs, tables and charts."""

from collections import defaultdict
from collections.abc import Hashable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pica.errors import PicaError
from pica.graph.chart import svg
from pica.graph.nodes import BlockNode
from pica.graph.plan import OUTSIDE, Plan, PlanPart
from pica.graph.resources import Buffer, Resource, Texture
from pica.images.saving import write_whole


@dataclass(frozen=True)
class PassInfo:
    """One pass, or other work that is recorded. Resources go by EFFECT/NAME."""

    name: str
    effect: str
    where: str
    """File and line that added it."""
    reads: tuple[str, ...]
    previous: tuple[str, ...]
    """Histories whose previous content it reads."""
    writes: tuple[str, ...]
    conditional: bool
    """Whether some frames leave it out."""
    milliseconds: float | None
    """In the newest frame that the device has finished; None where nothing was timed."""
    bytes: int | None = None
    """That it copied between devices in that frame; None for all but such copies."""


@dataclass(frozen=True)
class ResourceInfo:
    """One texture or buffer."""

    name: str
    effect: str
    where: str
    """File and line that declared it."""
    format: str
    """Of a texel; "" of buffers."""
    size: tuple[int, ...]
    """(width, height) in texels; () of buffers."""
    layers: int | None
    bytes: int
    """On the device: of a history both of its textures."""
    lifetime: str
    """"frame", "history" or "kept"; see `pica.graph.Lifetime`."""
    first: int
    """Number of the first pass that uses it, in `GraphDescription.passes`."""
    last: int
    lane: int
    """Resources of one lane share memory, one after the other."""

    @property
    def key(self) -> str:
        """EFFECT/NAME."""
        return f"{self.effect}/{self.name}"


@dataclass(frozen=True)
class GraphDescription:
    """The passes of a frame in order, and the resources that they read and write."""

    passes: tuple[PassInfo, ...]
    resources: tuple[ResourceInfo, ...]
    """In the order in which they were declared."""
    memory: Mapping[str, int]
    """Bytes on the device by effect; "shared" is memory that effects use one after the other."""

    @property
    def milliseconds(self) -> dict[str, float]:
        """By effect, in the order of the frame."""
        sums: defaultdict[str, float] = defaultdict(float)
        for node in self.passes:
            sums[node.effect] += node.milliseconds or 0.0
        return dict(sums)

    def sharing(self, resource: ResourceInfo) -> list[ResourceInfo]:
        """Other resources that use the same memory before or after it."""
        return [other for other in self.resources if other.lane == resource.lane and other is not resource]

    def as_dict(self) -> dict[str, Any]:
        """Everything, as JSON has it."""
        return {**asdict(self), "milliseconds": self.milliseconds}

    def svg(self, title: str = "Frame graph") -> str:
        """A chart: passes downwards, resources as bars from the first pass that uses them to the last."""
        return svg(self, title)

    def save(self, path: str | Path, title: str = "Frame graph") -> None:
        """Write the chart to an .svg. Raises PicaError for another suffix, or if it cannot be written."""
        if Path(path).suffix.lower() != ".svg":
            raise PicaError(f"cannot write {path}: the name must end in .svg")
        text = self.svg(title)
        write_whole(Path(path), lambda file: file.write_text(text, encoding="utf-8"))


def describe(plan: Plan, times: Mapping[Hashable, float], copied: Mapping[Hashable, int]) -> GraphDescription:
    """`times` and `copied`: milliseconds of a frame, and bytes copied between devices, by PlanPart."""
    times_by_part = {
        part: time for part, time in times.items() if isinstance(part, PlanPart) and part.plan == plan.serial
    }
    copies: defaultdict[int, list[PlanPart]] = defaultdict(list)
    for part in times_by_part:
        if part.copy:
            copies[part.node].append(part)
    nodes = [node for node in plan.nodes if not isinstance(node, BlockNode)]
    rows, row = dict[int, int](), 0
    for node in nodes:
        rows[node.index] = row
        row += 1 + len(copies[node.index])
    used: defaultdict[Resource, list[int]] = defaultdict(list)
    for node in nodes:
        for resource in (*node.reads, *node.writes, *node.previous):
            used[resource].append(rows[node.index])
    passes = list[PassInfo]()
    for node in nodes:
        passes.append(
            PassInfo(
                node.name,
                node.scope,
                node.where,
                _keys(node.reads),
                _keys(node.previous),
                _keys(node.writes),
                node.when is not None,
                times_by_part.get(PlanPart(plan.serial, node.scope, node.index)),
            )
        )
        passes += [
            PassInfo(part.copy, node.scope, node.where, (), (), (), True, times_by_part[part], copied.get(part, 0))
            for part in copies[node.index]
        ]
    lanes: dict[Any, int] = {}
    resources = []
    for resource in plan.resources:
        assert isinstance(resource, Texture | Buffer)
        lane = lanes.setdefault(_memory_of(plan, resource), len(lanes))
        resources.append(_described(resource, used[resource] or [0], lane))
    return GraphDescription(tuple(passes), tuple(resources), dict(plan.memory.bytes))


def _memory_of(plan: Plan, resource: Texture | Buffer) -> Any:
    return (resource.description, plan.places[resource]) if resource in plan.places else id(resource)


def _described(resource: Texture | Buffer, rows: list[int], lane: int) -> ResourceInfo:
    objects, texture = [resource.physical], resource if isinstance(resource, Texture) else None
    if isinstance(resource, Texture) and resource.history is not None:
        objects = [textures[resource.part] for textures in resource.history.sets]
    return ResourceInfo(
        resource.name,
        resource.scope,
        resource.where,
        texture.format.name if texture else "",
        tuple(texture.size) if texture else (),
        texture.layers if texture else None,
        sum(item.memory_usage.device for item in objects),
        resource.lifetime.value,
        min(rows),
        max(rows),
        lane,
    )


def _keys(resources: list[Any]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(f"{resource.scope}/{resource.name}" for resource in resources))


def times_by_effect(times: Mapping[Hashable, float]) -> dict[str, float]:
    """Milliseconds by effect, from times by PlanPart; passes outside of graphs belong to the scene."""
    sums: defaultdict[str, float] = defaultdict(float)
    for part, time in times.items():
        sums[part.effect if isinstance(part, PlanPart) else OUTSIDE] += time
    return dict(sums)
