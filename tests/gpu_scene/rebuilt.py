"""A scene made anew by the public constructors, of what another one's public fields hold."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Node, Scene
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.primitives import Primitives
from pica.scene.skin import Skin
from pica.scene.spline import Spline

NODE_FIELDS = [
    field.name
    for field in fields(Node)
    if field.init and not field.name.startswith("_") and field.name not in ("mesh", "detail")
]


def rebuilt(scene: Scene) -> Scene:
    """Another scene that shares nothing with this one that could be written to."""
    return _Copies().scene(scene)


class _Copies:
    """Copies by original: what is shared stays shared."""

    def __init__(self) -> None:
        self.made: dict[int, Any] = {}

    def __call__(self, kind: str, original: Any) -> Any:
        if original is None:
            return None
        if id(original) not in self.made:
            self.made[id(original)] = getattr(self, kind)(original)
        return self.made[id(original)]

    def scene(self, scene: Scene) -> Scene:
        environment = scene.environment
        if environment is not None:
            environment = replace(environment, radiance=environment.radiance.copy())
        copy = Scene(scene.name, environment)
        nodes = list(scene.nodes())
        for node in nodes:
            self.made[id(node)] = self.node(node)
        for node in nodes:
            above = copy if node.parent is None else self.made[id(node.parent)]
            above.add(self.made[id(node)])
        for node in nodes:
            self.shape(node, self.made[id(node)])
        return copy

    def node(self, node: Node) -> Node:
        made = self.facing(node.deformer) if isinstance(node.deformer, Sprites | Ribbons) else Node()
        for name in NODE_FIELDS:
            setattr(made, name, getattr(node, name))
        made.transform = node.transform
        return made

    def facing(self, deformer: Sprites | Ribbons) -> Node:
        material = self("material", deformer.node.mesh.sections[0].material)
        if isinstance(deformer, Sprites):
            copy = Sprites(deformer.capacity, material)
            copy.particles = Particles(**vars(deformer.particles))
        else:
            copy = Ribbons(deformer.strands, deformer.points, material)
            copy.set(deformer.positions, deformer.widths, deformer.colors, deformer.identities)
        return copy.node

    def shape(self, node: Node, made: Node) -> None:
        """The mesh and what deforms it, once all joints are in their tree."""
        if made.deformer is not None:
            return
        made.mesh = self("mesh", node.mesh)
        if isinstance(node.deformer, Spline):
            rows = node.deformer.rows[1:-1]
            made.deformer = Spline(rows[:, :3], rows[:, 3], rows[:, 7], extent=node.deformer.extent)
        if isinstance(node.deformer, DynamicVertices):
            DynamicVertices(made).set(node.deformer.positions, node.deformer.normals)
        if node.skin is not None:
            joints = [self.made[id(joint)] for joint in node.skin.joints]
            made.skin = Skin(joints, node.skin.inverse_bind.copy(), node.skin.name)
        if node.weights is not None:
            made.weights = node.weights

    def mesh(self, mesh: Mesh) -> Mesh:
        sections = [self("section", part) for part in mesh.sections]
        return Mesh(sections, mesh.name, [self("primitives", part) for part in mesh.primitives])

    def section(self, section: Section) -> Section:
        values = {field.name: getattr(section, field.name) for field in fields(section) if field.init}
        arrays = {name: value.copy() for name, value in values.items() if isinstance(value, np.ndarray)}
        return Section(**{**values, **arrays, "material": self("material", section.material)})

    def primitives(self, primitives: Primitives) -> Primitives:
        parameters = {name: values.copy() for name, values in primitives.parameters.items()}
        material = self("material", primitives.material)
        return Primitives(primitives.shape, parameters, primitives.bounds.copy(), material)

    def material(self, material: Material) -> Material:
        values = {field.name: getattr(material, field.name) for field in fields(material) if field.init}
        read = {name: self("texture", value) for name, value in values.items() if isinstance(value, Texture)}
        return Material(**{**values, **read})

    def texture(self, texture: Texture) -> Texture:
        sampler = Sampler(texture.sampler.wrap_u, texture.sampler.wrap_v, texture.sampler.linear)
        return Texture(self("image", texture.image), sampler, texture.uv_set, texture.transform)

    def image(self, image: Image) -> Image:
        return Image(image.pixels.copy(), image.name, image.encoding)
