"""A scene before and after it is saved and loaded again, for tests of Scene.save."""

from pathlib import Path
from typing import Any

from pica.scene.light import (
    DirectionalLight,
)
from pica.scene.loading import load
from pica.scene.material import Material
from pica.scene.mesh import Section
from pica.scene.model import Scene
from pica.scene.node import Node
from tests.scene.scene_fields import assert_same, fields_of_scene

SUN = DirectionalLight(illuminance=3.0)


def triangle(material: Material | None = None, **given: Any) -> Section:
    return Section.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], material=material, **given)


def shown(node: Node) -> Scene:
    """A scene with a light, which needs no sky, and the node."""
    scene = Scene("one node")
    scene.add(Node("sun", light=SUN))
    scene.add(node)
    return scene


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def saved(scene: Scene, folder: Path, suffix: str = ".glb") -> Scene:
    """The scene as loaded from a file that was saved; saving that again gives the same bytes."""
    first, second = folder / "first" / f"model{suffix}", folder / "second" / f"model{suffix}"
    for path in (first, second):
        path.parent.mkdir(exist_ok=True)
    scene.save(first)
    loaded = load(first)
    loaded.save(second)
    assert content(first.parent) == content(second.parent)
    return loaded


def check_same(scene: Scene, folder: Path, suffix: str = ".glb") -> Scene:
    loaded = saved(scene, folder, suffix)
    assert_same(fields_of_scene(scene), fields_of_scene(loaded))
    return loaded


def check_node(node: Node, folder: Path) -> Node:
    """Saves the node; returns it as loaded."""
    return check_same(shown(node), folder).roots[1]
