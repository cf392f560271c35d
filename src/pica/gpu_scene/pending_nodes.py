"""Nodes with new material types or shapes, added to a running renderer or edited, that wait until their programs are
compiled."""

from collections.abc import Iterable

from pica.errors import MaterialTypeError, PicaError
from pica.gpu_scene.edits import Edit
from pica.gpu_scene.materials import MaterialTable
from pica.programs.library import programs
from pica.programs.material_types import MaterialTypeSet, ShapeOn, TypeEntry
from pica.programs.program_round import ProgramRound
from pica.programs.recipes import TypeRecipe
from pica.programs.scene_features import (
    Features,
    features_of_environment,
    features_of_light,
    features_of_mesh,
    supported_features,
)
from pica.rhi.device import Device
from pica.rhi.profiler import FRAMES_IN_FLIGHT
from pica.scene.material_registry import material_source, registrations
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scene.primitives import Primitives
from pica.scene.shape_registry import shape_source


class PendingNodes:
    """Nodes and edits that wait for programs. One set of programs is compiled at a time; later ones wait for it."""

    def __init__(self, device: Device, materials: MaterialTable) -> None:
        self._device, self._materials = device, materials
        self._waiting: dict[Node, None] = {}
        self._ready: list[Node] = []
        self._awaiting_lights: dict[Node, None] = {}
        """Visible nodes whose new light waits for programs."""
        self._relit: list[Node] = []
        self._edits: dict[Edit, None] = {}
        """Edits that wait for programs."""
        self._ready_edits: list[Edit] = []
        self._round: ProgramRound | None = None
        self._refused: set[TypeEntry | str] = set()
        """Types that failed to compile, and names that are not registered."""
        self._registrations = registrations()
        self._needs_programs = False
        """Whether another set of programs may be needed."""
        self._retired: list[tuple[MaterialTypeSet, int]] = []
        self._frame = 0
        self._switched = False

    @property
    def pending(self) -> int:
        """How many programs are still to be made for types that are on their way."""
        return self._round.left if self._round is not None else int(self._needs_programs)

    @property
    def waiting(self) -> Iterable[Node]:
        """Nodes that are not visible yet."""
        return self._waiting

    def expect(self, nodes: list[Node]) -> None:
        """Queue added nodes."""
        supported = self._supported(nodes)
        for node in nodes:
            if node in supported:
                self._ready.append(node)
            else:
                self._waiting[node] = None
                self._needs_programs = True

    def expect_lights(self, nodes: list[Node]) -> None:
        """Queue nodes whose lights were set."""
        supported = self._supported_features() if nodes else frozenset()
        for node in nodes:
            self._awaiting_lights.pop(node, None)
            if node not in self._waiting and not features_of_light(node.light) <= supported:
                self._awaiting_lights[node] = None
                self._needs_programs = True

    def expect_edits(self, edits: list[Edit]) -> None:
        """Queue edits of visible content."""
        for edit in edits:
            if self._supports_edit(edit):
                self._edits.pop(edit, None)
                if edit not in self._ready_edits:
                    self._ready_edits.append(edit)
            else:
                self._edits[edit] = None
                self._needs_programs = True
        if edits and self._waiting:  # perhaps for less than before
            self._needs_programs = True

    @property
    def ready_edits(self) -> list[Edit]:
        """The edits that `take` will return."""
        return self._ready_edits

    def forget(self, nodes: list[Node]) -> None:
        """Drop removed nodes."""
        for node in nodes:
            self._waiting.pop(node, None)
            self._awaiting_lights.pop(node, None)
        if nodes and (self._ready or self._relit):
            removed = set(nodes)
            self._ready = [node for node in self._ready if node not in removed]
            self._relit = [node for node in self._relit if node not in removed]

    def awaits_programs(self, node: Node) -> bool:
        """Whether the node's light, as it is now, must wait."""
        return node in self._waiting or node in self._awaiting_lights

    def take(self) -> tuple[list[Node], list[Node], list[Edit], bool]:
        """Take what is ready: nodes to show, nodes with new lights, edits to apply, and whether the types in use have
        changed since the last call."""
        result = self._ready, self._relit, self._ready_edits, self._switched
        self._ready, self._relit, self._ready_edits, self._switched = [], [], [], False
        return result

    def step(self) -> None:
        """Do one frame's part of the work: at most one program is compiled.

        Raises MaterialTypeError or ShapeError once for a fault; nodes with that type wait until its name is registered
        again. The next step goes on with the others.
        """
        self._poll()
        if self._round is not None:
            self._advance_round(self._round)
        if self._round is None and self._needs_programs:
            types = self._target_types()
            self._needs_programs = False
            if types != self._materials.types:
                self._round = ProgramRound(self._device, self._materials.types, types)
            else:
                self._activate()

    def finish(self) -> None:
        """Activate everything now; missing programs are compiled at first use.

        Raises MaterialTypeError or ShapeError for a fault, each time.
        """
        self._poll()
        if self._round is None and not self._needs_programs and not self._refused:
            return
        if self._round is not None:
            self._round.cancel()
            self._round = None
        self._refused.clear()
        self._needs_programs = True
        types = self._target_types()
        for entry in types:
            self._check(entry)
        self._switch(types)
        self._needs_programs = False

    def _poll(self) -> None:
        """Count the frame, release retired programs, and note new registrations."""
        self._frame += 1
        if self._retired and self._retired[0][1] <= self._frame:
            programs(self._device).retire(self._retired.pop(0)[0])
        if self._registrations != registrations():
            self._registrations = registrations()
            self._refused = {refused for refused in self._refused if not isinstance(refused, str)}
            self._needs_programs = True

    def _supported(self, nodes: Iterable[Node]) -> set[Node]:
        """The nodes that both current and pending programs support."""
        meshes = {mesh for mesh in {node.mesh for node in nodes} if self._supports(mesh)}
        features = self._supported_features()
        return {node for node in nodes if node.mesh in meshes and features_of_light(node.light) <= features}

    def _supports(self, mesh: Mesh | None) -> bool:
        try:
            entries = {entry for section in _sections(mesh) for entry in _entries(section)}
        except PicaError:
            return False
        supported = all(entries.issubset(types) for types in self._used_types())
        return supported and features_of_mesh(mesh) <= self._supported_features()

    def _supports_edit(self, edit: Edit) -> bool:
        if isinstance(edit, Mesh):
            return self._supports(edit)
        return not isinstance(edit, Scene) or features_of_environment(edit) <= self._supported_features()

    def _supported_features(self) -> Features:
        return frozenset.intersection(*(supported_features(types) for types in self._used_types()))

    def _used_types(self) -> list[MaterialTypeSet]:
        """Of the current programs, and of the pending ones."""
        return [self._materials.types] if self._round is None else [self._materials.types, self._round.types]

    def _target_types(self) -> MaterialTypeSet:
        """The types in use and those required, as registered now, without refused ones."""
        types: list[TypeEntry] = []
        for name in self._materials.used_types:
            source = material_source(name)
            if source not in self._refused:
                types.append(source)
        features: Features = frozenset()
        for node in self._awaiting_lights:
            features |= features_of_light(node.light)
        added = [*self._ready, *self._waiting]  # ready nodes have no material in the table yet
        for light in {node.light for node in added}:
            features |= features_of_light(light)
        for edit in self._edits:
            features |= features_of_environment(edit) if isinstance(edit, Scene) else frozenset()
        edited = [edit for edit in self._edits if isinstance(edit, Mesh)]
        for mesh in dict.fromkeys([*(node.mesh for node in added), *edited]):
            features |= features_of_mesh(mesh)
            for section in _sections(mesh):
                name = _name(section)
                if name in self._refused:
                    continue
                try:
                    entries = _entries(section)
                except PicaError:
                    self._refused.add(name)
                    raise
                if self._refused.isdisjoint(entries):
                    types += entries
        return self._materials.types_with(types, features)

    def _advance_round(self, work: ProgramRound) -> None:
        try:
            done = work.step()
        except PicaError:
            self._refused.update(work.entries)
            self._round, self._needs_programs = None, True
            raise
        if done:
            self._round, self._needs_programs = None, True
            self._switch(work.types)

    def _switch(self, types: MaterialTypeSet) -> None:
        before = self._materials.types
        if types != before:
            try:
                self._materials.switch(types)
            except MaterialTypeError:
                names = {source.name for source in before}
                self._refused.update(source for source in types if source not in before and source.name in names)
                raise
            self._switched = True
            self._retired.append((before, self._frame + FRAMES_IN_FLIGHT))
        self._activate()

    def _activate(self) -> None:
        supported = self._supported(self._waiting)
        for node in [node for node in self._waiting if node in supported]:
            del self._waiting[node]
            for section in _sections(node.mesh):
                material = section.material
                compiled = programs(self._device).material_types[material_source(material.type)]
                compiled.packed(material.name, material.parameters)
            self._ready.append(node)
        for edit in [edit for edit in self._edits if self._supports_edit(edit)]:
            del self._edits[edit]
            self._ready_edits.append(edit)
        features = self._supported_features()
        for node in [node for node in self._awaiting_lights if features_of_light(node.light) <= features]:
            del self._awaiting_lights[node]
            self._relit.append(node)

    def _check(self, entry: TypeEntry) -> None:
        try:
            TypeRecipe(entry).link(self._device, ())
        except PicaError:
            self._refused.add(entry)
            raise


def _sections(mesh: Mesh | None) -> list[Section | Primitives]:
    return [] if mesh is None else mesh.parts


def _name(section: Section | Primitives) -> str:
    return f"{section.shape}/{section.material.type}" if isinstance(section, Primitives) else section.material.type


def _entries(section: Section | Primitives) -> list[TypeEntry]:
    """The types that programs need for it. Raises MaterialTypeError or ShapeError for a name that is not registered."""
    material = material_source(section.material.type)
    if isinstance(section, Primitives):
        return [material, ShapeOn(shape_source(section.shape), material)]
    return [material]
