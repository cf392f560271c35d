"""The tree of nodes, and inputs for the properties of what is selected."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from pica.scene.node import Node
from pica.viewer.properties import Property, environment_properties, property_groups
from pica.viewer.tree import MOST, tree_lines
from pica.viewer.viewer import Viewer
from pica.viewer.web.inputs import Input

if TYPE_CHECKING:
    import viser

_NOTHING = "(nothing)"


class SceneActions(Protocol):
    """What the panel asks the server for. The calls come from viser's threads, and return at once."""

    def change(self, act: Callable[[], object]) -> None:
        """Do something to the viewer, between two pictures."""

    def open_scene(self, name: str, content: bytes) -> None:
        """Show the scene of a .glb file instead."""

    def open_environment(self, name: str, content: bytes) -> None:
        """Light the scene by a .hdr or .exr file."""


class ScenePanel:
    """The inputs, which show the viewer as of the newest `refresh`."""

    def __init__(self, gui: "viser.GuiApi", viewer: Viewer, actions: "SceneActions") -> None:
        self._gui, self._viewer, self._change = gui, viewer, actions.change
        self._lines: dict[str, Node] = {}
        hint = f"The nodes of the scene, each below its parent; the first {MOST}. Type to search."
        self._tree = Input(gui.add_dropdown("Node", (_NOTHING,), initial_value=_NOTHING, hint=hint), self._select)
        steps = gui.add_button_group("Changes", ("Undo", "Redo"))
        steps.on_click(self._step)
        self._inputs: list[tuple[Property, Input]] = []
        self._folders: list[Any] = []
        self._layout: object = None
        """What the inputs are for."""
        self._place = gui.add_folder("Selected")
        self._environment: list[tuple[Property, Input]] = []
        self._environment_place = gui.add_folder("Environment")
        with self._environment_place:
            sky = gui.add_upload_button("Open .hdr, .exr, .ktx2", hint="An environment, for all light from around")
            sky.on_upload(partial(self._upload, actions.open_environment))
        with gui.add_folder("File"):
            scene = gui.add_upload_button("Open .glb", mime_type=".glb", hint="Another scene instead of this one")
            scene.on_upload(partial(self._upload, actions.open_scene))
        self.refresh()

    def refresh(self, again: bool = False) -> None:
        """Show the viewer as it is; `again` as Input.show."""
        viewer = self._viewer
        self._lines = tree_lines(viewer.scene)
        options = (_NOTHING, *self._lines)
        if options != self._tree.handle.options:
            self._tree.handle.options = options
        line = next((line for line, node in self._lines.items() if node is viewer.node), _NOTHING)
        self._tree.show(line, again)
        layout = viewer.node, viewer.materials, None if viewer.node is None else type(viewer.node.light)
        if layout != self._layout:
            self._layout = layout
            self._build()
        if bool(self._environment) != (viewer.scene.environment is not None):
            self._build_environment()
        for of, shown in (*self._inputs, *self._environment):
            shown.show(of.read(), again)

    def _build(self) -> None:
        for folder in self._folders:
            folder.remove()
        self._folders, self._inputs = [], []
        node = self._viewer.node
        if node is None:
            return
        with self._place:
            for group in property_groups(node, self._viewer.materials, self._viewer.visibility):
                folder = self._gui.add_folder(group.label)
                self._folders.append(folder)
                with folder:
                    self._inputs += [(each, self._input(each)) for each in group.properties]

    def _build_environment(self) -> None:
        for _, shown in self._environment:
            shown.handle.remove()
        with self._environment_place:
            self._environment = [(each, self._input(each)) for each in environment_properties(self._viewer.scene)]

    def _input(self, of: Property) -> Input:
        gui, value, more = self._gui, of.read(), {"hint": of.hint or None}
        match of.kind:
            case "boolean":
                handle: Any = gui.add_checkbox(of.label, value, **more)
            case "number":
                handle = gui.add_number(of.label, value, min=0.0, step=max(abs(value) / 20, 0.01), **more)
            case "share":
                handle = gui.add_slider(of.label, 0.0, 1.0, 0.01, value, **more)
            case "angle":
                handle = gui.add_slider(of.label, -180.0, 180.0, 1.0, value, **more)
            case "vector":
                handle = gui.add_vector3(of.label, value, step=0.01, **more)
            case "color":
                handle = gui.add_rgb(of.label, value, **more)
        return Input(handle, lambda value: self._change(partial(self._edit, of, value)))

    def _edit(self, of: Property, value: Any) -> None:
        self._viewer.edits.apply(of.changes(value))

    def _select(self, line: str) -> None:
        self._change(lambda: self._viewer.select(self._lines.get(line)))

    async def _step(self, event: "viser.GuiEvent[Any]") -> None:
        edits = self._viewer.edits
        self._change(edits.undo if event.target.value == "Undo" else edits.redo)

    async def _upload(self, opened: Callable[[str, bytes], None], event: "viser.GuiEvent[Any]") -> None:
        opened(event.target.value.name, event.target.value.content)
