"""Random edits in a row of all that a scene can hold: the picture stays that of a scene which was made so at once."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pica
from pica.quality.metrics import flip
from pica.scene.camera import Camera
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.light import DirectionalLight, DiskLight, PointLight, RectangleLight, SphereLight, SpotLight, TubeLight
from pica.scene.mesh import Mesh
from pica.scene.model import Node, Scene
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.primitives import spheres
from pica.scene.skin import Skin
from pica.scene.spline import Spline
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, placed
from tests.gpu_scene.edits import (
    CASES,
    ONCE,
    SETTINGS,
    SIZE,
    buffers,
    differing,
    everything,
    first_frame,
    material,
    named,
    stage,
    texture,
)
from tests.gpu_scene.rebuilt import rebuilt

OWN_RAYS = SETTINGS.with_values({"shadows.max_lights": "29"})
"""No light is chosen by chance, which would depend on the order in which they came."""
TOGGLED = [case for case in CASES if case[1] not in ONCE | {"name", "identities", "emission", "environment", "light"}]
"""Of what shines, triangles are chosen by chance."""
CURVE = np.array([(-0.9, 0.2, 0.6), (-0.4, 0.4, 0.8), (0.2, 0.2, 0.5), (0.6, 0.3, 0.9)])
LIGHTS = [
    lambda share: DirectionalLight((1, share, 1), 2 * share),
    lambda share: PointLight((1, 1, share), 3 * share, range=4.0 + share),
    lambda share: SpotLight(intensity=4 * share, outer_cone_angle=0.3 + share),
    lambda share: RectangleLight(radiance=3 * share, width=0.2 + share),
    lambda share: DiskLight(radiance=4 * share, radius=0.1 + 0.3 * share),
    lambda share: SphereLight(radiance=5 * share, radius=0.1 + 0.1 * share),
    lambda share: TubeLight(radiance=6 * share, length=0.3 + share),
]


class Editor:
    """Makes edits of a stage that has deforming things besides."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.scene: Scene = stage()
        material(self.scene).emission = (0, 0, 0)
        self.toggled: dict[tuple[Any, str], Any] = {}
        self.visitors: list[Node] = []
        self.lamps = [self._lamp(number) for number in range(len(LIGHTS))]
        self.spline = self.scene.add(placed(box((0.1, 0.1, 1), lambert(0.8, 0.3, 0.8)), move(0, 0, 0.2), "bent"))
        self.spline.deformer = Spline(CURVE, extent=(-0.5, 0.5))
        self.cloth = DynamicVertices(
            self.scene.add(placed(plane(1, 1, lambert(0.3, 0.8, 0.8, double_sided=True), 4), name="cloth"))
        )
        self.sprites = Sprites(6, lambert(0.9, 0.9, 0.3, double_sided=True))
        self.ribbons = Ribbons(2, 4, lambert(0.3, 0.9, 0.5, double_sided=True))
        for shown in (self.sprites, self.ribbons):
            self.scene.add(shown.node)
        self.joint = self._limb()
        self.edits: list[Callable[[], None]] = [
            *[self.toggle] * 8, self.shine, self.surround, self.come, self.come, self.go, self.move, self.move,
            self.recolour, self.repaint, self.scatter, self.bend, self.wave, self.fly, self.trail, self.rotate,
            self.morph,
        ]  # fmt: skip

    def __call__(self) -> str:
        edit = self.edits[self.random.integers(len(self.edits))]
        edit()
        return edit.__name__

    def _lamp(self, number: int) -> Node:
        node = self.scene.add(Node(f"lamp {number}", light=LIGHTS[number](0.5)))
        node.transform = aim(self.random.uniform((-1.5, 1, -1), (1.5, 2, 2)), (0, 0, 0))
        return node

    def _limb(self) -> Node:
        root = self.scene.add(Node("root"))
        joints = [root.add(Node("low")), Node("high")]
        joints[0].add(joints[1])
        arm = box((0.1, 0.8, 0.1), lambert(0.6, 0.2, 0.2))
        upper = np.clip(arm.positions[:, 1] + 0.5, 0, 1).astype(np.float32)
        arm = replace(
            arm,
            joints=np.tile(np.array([0, 1], np.uint16), (len(upper), 1)),
            weights=np.stack([1 - upper, upper], 1),
        )
        limb = self.scene.add(placed(arm, name="limb"))
        limb.skin = Skin(joints, np.stack([np.eye(4)] * 2))
        root.transform = move(-1.3, 0.5, 0.3)
        return joints[1]

    def _place(self) -> np.ndarray:
        return move(*self.random.uniform((-1.4, 0.1, -1), (1.4, 1.2, 1.2))) @ rotate("y", self.random.uniform(0, 360))

    def _color(self) -> tuple[float, ...]:
        return (*self.random.uniform(0.1, 0.9, 3).tolist(), 1.0)

    def toggle(self) -> None:
        """Any field, to its other value or back."""
        kind, name = TOGGLED[self.random.integers(len(TOGGLED))]
        try:
            holder = CASES[kind, name].holder(self.scene)
        except (AttributeError, IndexError):  # an edit before has taken it away
            return
        if (holder, name) in self.toggled:
            setattr(holder, name, self.toggled.pop((holder, name)))
        else:
            self.toggled[holder, name] = before = getattr(holder, name)
            setattr(holder, name, CASES[kind, name].value(before, self.scene))

    def shine(self) -> None:
        lamp = self.lamps[self.random.integers(len(self.lamps))]
        lamp.light = LIGHTS[self.random.integers(len(LIGHTS))](self.random.uniform(0.1, 1))

    def surround(self) -> None:
        strength, rotation = self.random.uniform(0.2, 2), self.random.uniform(0, 6)
        self.scene.environment = replace(self.scene.environment, strength=strength, rotation=rotation)

    def come(self) -> None:
        parts = [sphere(0.2, lambert(*self._color()[:3]), segments=8), box(0.3, everything())]
        part = parts[self.random.integers(2)]
        part.material.emission = (0, 0, 0)
        node = Node("visitor", mesh=Mesh([part]))
        if self.random.random() < 0.3:
            node.mesh.primitives = [spheres([[0.2, 0, 0]], 0.1, part.material)]
        node.transform = self._place()
        above = self.visitors[-1] if self.visitors and self.random.random() < 0.3 else self.scene
        self.visitors.append(above.add(node))

    def go(self) -> None:
        if self.visitors:
            gone = self.visitors[self.random.integers(len(self.visitors))]
            self.scene.remove(gone)
            below = set(gone.walk())
            self.visitors = [node for node in self.visitors if node not in below]
            if self.random.random() < 0.3:
                self.visitors.append(self.scene.add(gone))
                self.visitors += [node for node in below if node is not gone]

    def move(self) -> None:
        movable = [*self.visitors, *self.lamps, named(self.scene, "ball"), named(self.scene, "beads")]
        movable[self.random.integers(len(movable))].transform = self._place()

    def recolour(self) -> None:
        parts = [part for node in self.scene.nodes() if node.mesh is not None for part in node.mesh.parts]
        part = parts[self.random.integers(len(parts))]
        if self.random.random() < 0.5:
            part.material.base_color, part.material.roughness = self._color(), self.random.uniform(0.2, 1)
        else:
            part.material = lambert(*self._color()[:3])

    def repaint(self) -> None:
        painted = material(self.scene).base_color_texture
        if painted is not None and self.random.random() < 0.5:
            size = int(self.random.integers(2, 9))
            painted.image.pixels = self.random.integers(60, 250, (size, size, 4)).astype(np.uint8)
        else:
            other = texture(int(self.random.integers(99)), 4)
            material(self.scene).base_color_texture = replace(other, transform=(2, 0, self.random.random(), 0, 1, 0))

    def scatter(self) -> None:
        count = int(self.random.integers(1, 4))
        if self.visitors:
            node = self.visitors[self.random.integers(len(self.visitors))]
            node.place_instances(np.stack([move(0.3 * i, 0, self.random.random()) for i in range(count)]))

    def bend(self) -> None:
        self.spline.deformer.set(CURVE + self.random.normal(0, 0.1, CURVE.shape), self.random.uniform(-1, 1, 4))

    def wave(self) -> None:
        places = self.cloth.positions + self.random.normal(0, 0.03, (self.cloth.count, 3))
        self.cloth.set(places)

    def fly(self) -> None:
        count = int(self.random.integers(0, 7))
        colors = self.random.uniform(0.2, 1, (count, 4))
        places = self.random.uniform((-1, 0.2, 0), (1, 1, 1), (count, 3))
        self.sprites.particles = Particles(places, self.random.uniform(0.05, 0.2, (count, 2)), colors)

    def trail(self) -> None:
        places = self.random.uniform((-1, 0.2, 0), (1, 1, 1), (2, 4, 3))
        self.ribbons.set(places, self.random.uniform(0.02, 0.1), self.random.uniform(0.2, 1, (2, 4, 4)))

    def rotate(self) -> None:
        self.joint.transform = rotate("z", self.random.uniform(-60, 60))

    def morph(self) -> None:
        named(self.scene, "shape").weights = [self.random.random()]


def view(random: np.random.Generator) -> Camera:
    return Camera.look_at(random.uniform((-2, 0.8, 2.5), (2, 2, 3.5)), (0, 0.3, 0), vertical_fov=0.8)


@pytest.mark.parametrize(
    ("edits", "checks"), [(120, 3), pytest.param(1000, 20, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])]
)
def test_edits_in_a_row_end_where_a_fresh_build_begins(device, edits, checks):
    editor = Editor(seed=edits)
    memory = 0
    made: dict[str, int] = {}
    with pica.Renderer(editor.scene, size=SIZE, settings=OWN_RAYS, device=device) as renderer:
        for step in range(1, edits + 1):
            name = editor()
            made[name] = made.get(name, 0) + 1
            if step % 7 == 0:
                renderer.advance(view(editor.random))
            if step % (edits // checks) == 0:
                found = first_frame(renderer)
                assert found.aov("depth").min() < 10 and found.color.mean() > 0.01
                with pica.Renderer(rebuilt(editor.scene), size=SIZE, settings=OWN_RAYS, device=device) as fresh:
                    expected = first_frame(fresh)
                # Lights that came in another order are summed in another: a pixel's last digits.
                assert set(differing(buffers(found), buffers(expected))) <= {"color"}, (step, made)
                np.testing.assert_allclose(found.color, expected.color, rtol=3e-3, atol=3e-4)
                assert flip(expected.display / 255, found.display / 255)[0] < 1e-5, (step, made)
                memory = memory or device.memory
        assert len(made) == len({edit.__name__ for edit in editor.edits})
        assert device.memory < 1.5 * memory


def test_a_rebuilt_scene_shares_nothing_that_can_be_written_to():
    scene = stage()
    copy = rebuilt(scene)
    before, after = material(scene), material(copy)
    assert before is not after and before.base_color_texture.image is not after.base_color_texture.image
    assert not set(scene.nodes()) & set(copy.nodes())
    for name in ("ball", "beads"):
        one, other = named(scene, name).mesh, named(copy, name).mesh
        assert one is not other and not {*map(id, one.parts)} & {*map(id, other.parts)}
