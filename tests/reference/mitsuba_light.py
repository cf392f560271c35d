"""pica's lights without triangles as a Mitsuba 3 emitter that only direct light sampling can find.

It gives the same mean as one that other rays could hit. As in pica, cameras do not see it and it casts no shadow.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.light import DirectionalLight, DiskLight, Light, RectangleLight, SphereLight, SpotLight
from tests.reference.variant import dr, mi


class PicaLight(mi.Emitter):
    """A disk in the sky, a sphere or a flat shape in the world."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.m_flags = mi.EmitterFlags.DeltaDirection

    def use(self, light: Light, world: NDArray[np.float64], far: float) -> "PicaLight":
        """Shine as `light` at the node whose (4, 4) matrix is `world`; `far` is beyond the scene. Returns self."""
        self.light, self.world, self.far = light, world, far
        self.position = [float(x) for x in world[:3, 3]]
        self.axis = [float(x) for x in -world[:3, 2] / np.linalg.norm(world[:3, 2])]
        return self

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, mi.Color3f]:
        if isinstance(self.light, DirectionalLight):
            direction, reach, irradiance = self._sun(sample)
        elif isinstance(self.light, RectangleLight | DiskLight):
            direction, reach, irradiance = self._flat(it.p, sample)
        else:
            direction, reach, irradiance = self._ball(it.p, sample)
        ds = dr.zeros(mi.DirectionSample3f, dr.width(it.p))
        ds.p, ds.d, ds.dist = it.p + direction * reach, direction, reach
        ds.n = mi.Normal3f(-direction)
        ds.pdf, ds.delta = mi.Float(1), mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        color = mi.Color3f([float(c) for c in self.light.color])
        return ds, dr.select(active, color * irradiance, 0.0)

    # Each of these gives a direction, how far the light is there, and the radiance over the direction's density.

    def _sun(self, sample: Any) -> tuple[mi.Vector3f, mi.Float, mi.Float]:
        half_angle = self.light.angular_diameter / 2
        irradiance = mi.Float(self.light.illuminance)
        if half_angle == 0:
            return -mi.Vector3f(self.axis), mi.Float(2 * self.far), irradiance
        cut = math.cos(half_angle)
        direction = self._cone(-mi.Vector3f(self.axis), mi.Float(cut), sample)
        return direction, mi.Float(2 * self.far), irradiance * 2 / (1 + cut)

    def _ball(self, point: Any, sample: Any) -> tuple[mi.Vector3f, mi.Float, mi.Float]:
        offset, radius = mi.Point3f(self.position) - point, self.light.radius
        distance = dr.norm(offset)
        axis = mi.Vector3f(offset / distance)
        if isinstance(self.light, SphereLight):
            intensity = mi.Float(self.light.radiance * math.pi * radius**2)
        else:
            intensity = self.light.intensity * self._falloff(axis, distance)
        irradiance = intensity / dr.square(distance)
        if radius == 0:
            return axis, distance, irradiance
        cut = dr.safe_sqrt(1 - dr.square(radius / distance))
        direction = self._cone(axis, cut, sample)
        along = dr.dot(direction, offset)
        near = along - dr.safe_sqrt(dr.square(radius) - dr.squared_norm(offset - direction * along))
        return direction, near, dr.select(distance > radius, irradiance * 2 / (1 + cut), 0)

    def _flat(self, point: Any, sample: Any) -> tuple[mi.Vector3f, mi.Float, mi.Float]:
        if isinstance(self.light, DiskLight):
            place = mi.warp.square_to_uniform_disk(sample) * self.light.radius
            unit_area = math.pi * self.light.radius**2
        else:
            place = (sample - 0.5) * mi.Vector2f(self.light.width, self.light.height)
            unit_area = self.light.width * self.light.height
        right, up = self.world[:3, 0], self.world[:3, 1]
        area = unit_area * float(np.linalg.norm(np.cross(right, up)))
        across = mi.Vector3f(right.tolist()) * place.x + mi.Vector3f(up.tolist()) * place.y
        offset = mi.Point3f(self.position) + across - point
        distance = dr.norm(offset)
        direction = mi.Vector3f(offset / distance)
        facing = dr.maximum(-dr.dot(direction, mi.Vector3f(self.axis)), 0)
        return direction, distance, self.light.radiance * area * facing / dr.square(distance)

    def _cone(self, axis: mi.Vector3f, cut: mi.Float, sample: Any) -> mi.Vector3f:
        """A direction uniformly in a cone; with a disk of radiance E / (pi sin^2) in it, radiance over density is
        E 2 pi (1 - cos) / (pi sin^2) = 2 E / (1 + cos)."""
        return mi.Frame3f(axis).to_world(mi.warp.square_to_uniform_cone(sample, cut))

    def _falloff(self, axis: mi.Vector3f, distance: mi.Float) -> mi.Float:
        """Range window and cone of KHR_lights_punctual ("Range Property", "Inner and Outer Cone Angles")."""
        fade = mi.Float(1)
        if self.light.range is not None:
            fade = dr.clip(1 - (distance / self.light.range) ** 4, 0, 1)
        if isinstance(self.light, SpotLight):
            inner, outer = math.cos(self.light.inner_cone_angle), math.cos(self.light.outer_cone_angle)
            cone = dr.clip((dr.dot(-axis, mi.Vector3f(self.axis)) - outer) / max(inner - outer, 1e-4), 0, 1)
            fade *= dr.square(cone)
        return fade

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Color3f:
        return mi.Color3f(0)

    def eval(self, si: Any, active: Any = True) -> mi.Color3f:
        return mi.Color3f(0)

    def to_string(self) -> str:
        return f"PicaLight[{self.light}]"
