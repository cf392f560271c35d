"""The panel of the window: its widgets need no display, and are used here as ImGui does."""

import random
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import slangpy as spy
from slangpy import ui

import pica
from pica.errors import PicaError
from pica.scene.light import PointLight
from pica.scene.model import Node
from pica.viewer.setting_controls import setting_controls
from pica.viewer.viewer import Viewer
from pica.viewer.window.fields import COLUMNS, wrapped
from pica.viewer.window.panel import Panel
from tests.viewer.scenes import CAMERA, CANVAS, scene
from tests.viewer.window.driving import controls, use


class Actions:
    """Does at once what the window does between two pictures."""

    def __init__(self, viewer):
        self.viewer, self.view = viewer, viewer.view(CANVAS, CAMERA)
        self.refused, self.asked = [], []

    def change(self, act):
        try:
            act()
        except PicaError as error:
            self.refused.append(str(error))
        self.panel.refresh()

    def move(self, act):
        self.change(lambda: act(self.view.control))

    def choose_settings(self, change):
        self.change(lambda: self.viewer.configure(change(self.viewer.settings)))

    def save(self):
        self.asked.append("save")

    def save_frame(self):
        self.asked.append("save_frame")

    def save_path(self):
        self.asked.append("save_path")

    def open(self, name):
        self.asked.append(name)


@pytest.fixture
def used(device):
    """A panel, and `set(path, value)` of a control."""
    shown = scene()
    shown.add(Node("lamp", light=PointLight(intensity=50.0)))
    viewer = Viewer(shown, settings=pica.Settings.preset("raster"), device=device, frames=2)
    window, actions = ui.Window(None, "pica"), Actions(viewer)
    actions.panel = Panel(window, viewer, actions)
    viewer.render(actions.view)
    actions.panel.refresh()
    yield SimpleNamespace(
        window=window,
        viewer=viewer,
        actions=actions,
        find=lambda path: dict(controls(window))[path],
        set=lambda path, value=None: use(dict(controls(window))[path], random.Random(0), value),
    )
    viewer.close()


def choose(used, path, text):
    used.set(path, used.find(path).items.index(text))


def test_there_is_a_control_for_each_setting_with_its_text(used):
    labels = [path for path, _ in controls(used.window) if path.startswith("/Settings/")]
    wanted = [f"/Settings/{group.label}/{control.label}" for group in setting_controls() for control in group.controls]
    assert set(wanted) <= set(labels)
    [settings] = [place for place in used.window.children if getattr(place, "label", "") == "Settings"]
    groups = {place.label: place for place in settings.children if isinstance(place, ui.Group)}
    for group in setting_controls():
        texts = [each.text for each in groups[group.label].children if isinstance(each, ui.Text)]
        assert {wrapped(control.text) for control in group.controls} <= set(texts)
        assert max(len(line) for text in texts for line in text.splitlines()) <= COLUMNS


def test_settings_change_and_levels_and_presets_follow(used):
    used.set("/Settings/Post/Exposure", 1.5)
    assert used.viewer.settings.post.exposure == 1.5
    choose(used, "/Settings/Shadows/Level", "high")
    assert used.find("/Settings/Shadows/Level").value == used.find("/Settings/Shadows/Level").items.index("high")
    choose(used, "/Settings/Preset", "raster")
    assert used.viewer.settings == pica.Settings.preset("raster")
    assert used.find("/Settings/Post/Exposure").value == 0
    used.set("/Settings/Shadows/Max lights", 3)
    assert used.viewer.settings.shadows.max_lights == 3
    preset = used.find("/Settings/Preset")
    assert preset.items[preset.value] == "(own values)"


def test_one_part_and_one_group_is_in_sight(used):
    def seen():
        return [each.label for each in used.window.children if isinstance(each, ui.Group) and each.visible]

    assert seen() == ["View"]
    choose(used, "/Panel", "Settings")
    assert seen() == ["Settings"]
    choose(used, "/Settings/Group", "Post")
    [settings] = [each for each in used.window.children if getattr(each, "label", "") == "Settings"]
    assert [each.label for each in settings.children if isinstance(each, ui.Group) and each.visible] == ["Post"]


def test_a_node_of_the_tree_is_selected_changed_and_changed_back(used):
    choose(used, "/Scene/Node", "cube")
    assert used.viewer.node.name == "cube"
    path = "/Scene/Selected/Node cube/Translation"
    assert [round(value, 3) for value in used.find(path).value] == [0, 0.5, 0]
    used.set(path, spy.float3(1, 0.25, 0.1))
    assert used.viewer.node.transform[:3, 3].tolist() == [1, 0.25, 0.1], "with the digits that were meant"
    used.set("/Scene/Undo")
    assert used.viewer.node.transform[:3, 3].tolist() == [0, 0.5, 0]
    assert [round(value, 3) for value in used.find(path).value] == [0, 0.5, 0]
    assert "/Scene/Undo" not in dict(controls(used.window)), "there is nothing more"
    used.set("/Scene/Redo")
    assert used.viewer.node.transform[:3, 3].tolist() == [1, 0.25, 0.1]
    used.set("/Scene/Selected/Material red|paint/Roughness", 0.25)
    assert used.viewer.materials[0].roughness == 0.25
    used.set("/Scene/Selected/Material red|paint/Base colour", spy.int3(255, 0, 0))
    assert used.viewer.materials[0].base_color[:3] == (1, 0, 0)
    choose(used, "/Scene/Node", "lamp")
    used.set("/Scene/Selected/PointLight/Intensity", 7.5)
    assert used.viewer.node.light.intensity == 7.5
    used.set("/Scene/Selected/Node lamp/Visible", False)
    assert used.viewer.node.light is None
    assert not [path for path, _ in controls(used.window) if "PointLight" in path], "a hidden lamp has no intensity"


def test_what_is_refused_is_shown_as_it_was(used):
    viewer = used.viewer
    choose(used, "/View/Shown", "normal")
    assert viewer.shown == "normal"
    shown = used.find("/View/Shown")
    used.actions.panel._shown.offer([*viewer.showable, "nonsense"])
    choose(used, "/View/Shown", "nonsense")
    assert used.actions.refused and shown.items[shown.value] == "normal"


def test_a_fault_in_a_shader_ends_the_wait(used, monkeypatch):
    panel = used.actions.panel
    panel.say("Compiling shaders: 1 of 2")
    monkeypatch.setattr(used.viewer, "follow_shaders", Mock(side_effect=PicaError("step.slang:3: a fault")))
    with pytest.raises(PicaError, match="a fault"):
        panel.follow_shaders()
    assert panel._status.text == "Shaders as before"


def test_time_cameras_and_the_path(used):
    playback = used.viewer.playback
    used.set("/View/Animation/Seconds", 1.0)
    assert playback.time == 1.0 and used.viewer.scene.nodes()
    used.set("/View/Animation/Play", True)
    assert playback.playing
    before = used.actions.view.control.camera
    used.set("/View/Camera/Frame all")
    assert used.actions.view.control.camera is not before
    used.set("/View/Camera/Home")
    assert used.actions.view.control.camera is before
    used.set("/View/Camera/Position", spy.float3(0, 2, 3))
    used.set("/View/Camera/Target", spy.float3(0, 2, 0))
    used.set("/View/Camera/Field of view", 60.0)
    camera = used.actions.view.control.camera
    np.testing.assert_allclose(camera.transform[:3, 2:], [[0, 0], [0, 2], [1, 3]], atol=1e-6)
    assert np.degrees(camera.vertical_fov) == pytest.approx(60)
    for _ in range(2):
        used.set("/View/Camera/Path/Add")
    assert len(used.viewer.path) == 2
    used.set("/View/Camera/Path/Save")
    used.set("/View/Camera/Save picture")
    used.set("/View/Camera/Save .exr")
    used.set("/Scene/File/Name", "cornell")
    used.set("/Scene/File/Open")
    assert used.actions.asked == ["save_path", "save", "save_frame", "cornell"]
    used.set("/View/Camera/Path/Clear")
    assert len(used.viewer.path) == 0


def test_the_environment_of_the_scene(used):
    used.set("/Scene/Environment/Strength", 0.5)
    used.set("/Scene/Environment/Turned by", 90.0)
    assert used.viewer.scene.environment.strength == 0.5
    assert used.viewer.scene.environment.rotation == pytest.approx(1.5708, abs=1e-3)
