"""pica's material as a Mitsuba 3 BSDF, written from the equations and not from the shaders."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.material import AlphaMode, Material, Texture, Wrap
from tests.reference.ggx_energy import MINIMUM_ALPHA, energy_tables, ggx, smith_over_cosines
from tests.reference.variant import dr, mi

_WRAPS = {
    Wrap.REPEAT: dr.WrapMode.Repeat,
    Wrap.MIRRORED_REPEAT: dr.WrapMode.Mirror,
    Wrap.CLAMP_TO_EDGE: dr.WrapMode.Clamp,
}


class TextureReader:
    """Reads pica textures in linear units; keeps every image once."""

    def __init__(self) -> None:
        self._images: dict[tuple[object, ...], mi.Texture2f] = {}

    def __call__(self, texture: Texture, srgb: bool, si: mi.SurfaceInteraction3f, active: mi.Bool) -> list[mi.Float]:
        """Red, green, blue and alpha at the surface point; sRGB is decoded before interpolation."""
        sampler = texture.sampler
        assert sampler.wrap_u == sampler.wrap_v, "Dr.Jit textures wrap both axes alike"
        key = (id(texture.image), srgb, sampler)
        if key not in self._images:
            filtering = dr.FilterMode.Linear if sampler.linear else dr.FilterMode.Nearest
            pixels = linear_pixels(texture, srgb)
            self._images[key] = mi.Texture2f(
                mi.TensorXf(pixels), wrap_mode=_WRAPS[sampler.wrap_u], filter_mode=filtering
            )
        uv = si.uv
        if texture.uv_set == 1:
            uv = mi.Point2f(si.shape.eval_attribute_3("vertex_uv1", si, active).xy)
        a, b, c, d, e, f = texture.transform
        uv = mi.Point2f(a * uv.x + b * uv.y + c, d * uv.x + e * uv.y + f)
        return list(self._images[key].eval(uv, active))


def linear_pixels(texture: Texture, srgb: bool) -> NDArray[np.float32]:
    """(height, width, 4) linear values; alpha is linear always (IEC 61966-2-1 for the rest)."""
    values = texture.image.pixels.astype(np.float32) / 255
    if srgb if texture.image.encoding is None else texture.image.encoding == "srgb":
        color = values[..., :3]
        values[..., :3] = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return values


class PicaSurface(mi.BSDF):
    """A two-sided metallic-roughness surface; `material` and `textures` are set after construction."""

    material: Material
    textures: TextureReader

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        lobes = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.DiffuseReflection
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [lobes | sides, mi.BSDFFlags.Null | sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def use(self, material: Material, textures: TextureReader) -> "PicaSurface":
        """Show `material`; returns self."""
        self.material, self.textures = material, textures
        if material.alpha_mode is AlphaMode.OPAQUE:
            self.m_components = self.m_components[:1]
            self.m_flags = self.m_components[0]
        return self

    def _read(self, name: str, srgb: bool, si: Any, active: Any) -> list[mi.Float]:
        texture = getattr(self.material, name)
        return [mi.Float(1)] * 4 if texture is None else self.textures(texture, srgb, si, active)

    def _coverage(self, si: Any, active: Any) -> mi.Float:
        """Share of rays that meet the surface (glTF 2.0, 3.9.4)."""
        material = self.material
        if material.alpha_mode is AlphaMode.OPAQUE:
            return mi.Float(1)
        alpha = self._read("base_color_texture", True, si, active)[3] * material.base_color[3]
        alpha *= si.shape.eval_attribute_1("vertex_alpha", si, active)
        if material.alpha_mode is AlphaMode.MASK:
            return dr.select(alpha < material.alpha_cutoff, 0.0, 1.0)
        return dr.clip(alpha, 0, 1)

    def _lobes(self, si: Any, active: Any) -> "Lobes":
        material = self.material
        tint = si.shape.eval_attribute_3("vertex_tint", si, active)
        base = mi.Color3f(self._read("base_color_texture", True, si, active)[:3]) * tint * list(material.base_color[:3])
        packed = self._read("metallic_roughness_texture", False, si, active)
        specular = material.specular * self._read("specular_texture", False, si, active)[3]
        specular_color = mi.Color3f(self._read("specular_color_texture", True, si, active)[:3])
        specular_color *= list(material.specular_color)
        return Lobes(
            base, packed[2] * material.metallic, packed[1] * material.roughness, material.ior, specular, specular_color
        )

    def _frame(self, si: Any, active: Any) -> tuple[mi.Frame3f, mi.Float]:
        """Shading frame on the viewer's side, and that side: 1 in front, -1 behind."""
        normal = si.sh_frame.n
        if self.material.normal_texture is not None:
            # Tangent frame as in glTF 2.0, 3.7.2.1; the texture as in 3.9.3.
            tangent = mi.Vector3f(si.shape.eval_attribute_3("vertex_tangent", si, active))
            tangent = dr.normalize(tangent - mi.Vector3f(normal) * dr.dot(normal, tangent))
            sign = dr.select(si.shape.eval_attribute_1("vertex_tangent_sign", si, active) < 0, -1.0, 1.0)
            bitangent = dr.cross(mi.Vector3f(normal), tangent) * sign
            r, g, b, _ = self._read("normal_texture", False, si, active)
            scale = self.material.normal_scale
            mapped = tangent * (2 * r - 1) * scale + bitangent * (2 * g - 1) * scale
            normal = dr.normalize(mi.Normal3f(mapped + mi.Vector3f(normal) * dr.maximum(2 * b - 1, 1e-3)))
        view = si.to_world(si.wi)
        side = dr.select(dr.dot(si.n, view) < 0, -1.0, 1.0)
        normal = normal * side
        # pica bends a normal that looks away from the viewer until it just faces them.
        facing = dr.dot(normal, view)
        normal = dr.select(facing >= 0.01, normal, dr.normalize(normal + mi.Normal3f(view) * (0.01 - facing)))
        return mi.Frame3f(normal), side

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[mi.Color3f, mi.Float]:
        frame, side = self._frame(si, active)
        light_world = si.to_world(wo)
        view, light = frame.to_local(si.to_world(si.wi)), frame.to_local(light_world)
        active = active & (view.z > 0) & (light.z > 0) & (dr.dot(si.n, light_world) * side > 0)
        lobes, coverage = self._lobes(si, active), self._coverage(si, active)
        value = lobes.evaluate(view, light) * light.z * coverage
        return dr.select(active, value, 0.0), dr.select(active, lobes.pdf(view, light) * coverage, 0.0)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> mi.Color3f:
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> mi.Float:
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, mi.Color3f]:
        frame, _ = self._frame(si, active)
        lobes, coverage = self._lobes(si, active), self._coverage(si, active)
        passes = sample1 >= coverage
        choice = dr.minimum(sample1 / dr.maximum(coverage, 1e-6), 1 - 1e-6)
        view = frame.to_local(si.to_world(si.wi))
        out = mi.BSDFSample3f()
        out.wo = dr.select(passes, -si.wi, si.to_local(frame.to_world(lobes.sample(view, choice, sample2))))
        value, pdf = self.eval_pdf(ctx, si, out.wo, active & ~passes)
        out.pdf = dr.select(passes, 1 - coverage, pdf)
        out.eta = 1.0
        out.sampled_component = dr.select(passes, mi.UInt32(1), mi.UInt32(0))
        out.sampled_type = dr.select(passes, mi.UInt32(+mi.BSDFFlags.Null), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
        weight = dr.select(pdf > 0, value / dr.maximum(pdf, 1e-12), 0.0)
        return out, dr.select(passes, mi.Color3f(1), weight)

    def eval_null_transmission(self, si: Any, active: Any = True) -> mi.Color3f:
        return mi.Color3f(1 - self._coverage(si, active))

    def to_string(self) -> str:
        return f"PicaSurface[{self.material.name}]"


class DiffuseTransmitter(mi.BSDF):
    """Lets all light through, evenly in all directions behind it, tinted."""

    color: tuple[float, float, float]

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.DiffuseTransmission | sides]
        self.m_flags = self.m_components[0]

    def use(self, material: Material) -> "DiffuseTransmitter":
        """Show `material`; returns self."""
        assert (material.diffuse_transmission, material.specular, material.transmission) == (1.0, 0.0, 0.0)
        self.color = material.diffuse_transmission_color
        return self

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> mi.Color3f:
        return mi.Color3f(list(self.color)) * self.pdf(ctx, si, wo, active)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> mi.Float:
        return dr.select(active & (si.wi.z * wo.z < 0), dr.abs(wo.z) * dr.inv_pi, 0.0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[mi.Color3f, mi.Float]:
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, mi.Color3f]:
        out = mi.BSDFSample3f()
        behind = mi.warp.square_to_cosine_hemisphere(sample2)
        out.wo = dr.select(si.wi.z > 0, -behind, behind)
        out.pdf = self.pdf(ctx, si, out.wo, active)
        out.eta = 1.0
        out.sampled_component = mi.UInt32(0)
        out.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseTransmission)
        return out, mi.Color3f(list(self.color))

    def to_string(self) -> str:
        return "DiffuseTransmitter[]"


class Lobes:
    """The reflectance at a surface point: a GGX lobe over a Lambert base, both energy-conserving."""

    def __init__(
        self,
        base: mi.Color3f,
        metallic: mi.Float,
        roughness: mi.Float,
        ior: float,
        specular: mi.Float,
        specular_color: mi.Color3f,
    ) -> None:
        # glTF 2.0, appendix B.3.5, with KHR_materials_specular and KHR_materials_ior.
        reflectance = ((ior - 1) / (ior + 1)) ** 2 if ior else 1.0
        self.dielectric_f0 = dr.minimum(reflectance * specular_color, 1.0) * specular
        self.dielectric_f90 = mi.Color3f(specular)
        self.f0 = dr.lerp(self.dielectric_f0, base, metallic)
        self.f90 = mi.Color3f(dr.lerp(specular, 1.0, metallic))
        self.diffuse = base * (1 - metallic)
        self.roughness = dr.clip(roughness, 0, 1)
        self.dielectric_bounces = self._bounces(self.dielectric_f0, self.dielectric_f90)
        self.bounces = dr.lerp(self.dielectric_bounces, self._bounces(base, mi.Color3f(1)), metallic)
        self.alpha = dr.maximum(dr.square(self.roughness), MINIMUM_ALPHA)

    def evaluate(self, view: mi.Vector3f, light: mi.Vector3f) -> mi.Color3f:
        """Bidirectional reflectance, 1 / steradian."""
        half = dr.normalize(view + light)
        schlick = (1 - dr.clip(dr.dot(view, half), 0, 1)) ** 5
        fresnel = self.f0 + (self.f90 - self.f0) * schlick
        single = fresnel * ggx(half.z, self.alpha) * smith_over_cosines(view.z, light.z, self.alpha)
        return single + self._multiple(view.z, light.z) + self._base(view.z, light.z)

    def _multiple(self, view: mi.Float, light: mi.Float) -> mi.Color3f:
        """Light that bounces between facets more than once (C. Kulla and A. Conty, "Revisiting Physically
        Based Shading at Imageworks", SIGGRAPH 2017 course, slides 13 to 17)."""
        energy = energy_tables()
        average = energy.average(self.roughness)
        lost = (1 - energy.white(view, self.roughness)) * (1 - energy.white(light, self.roughness))
        return self.bounces * lost / dr.maximum(dr.pi * (1 - average), 1e-6)

    def _bounces(self, f0: mi.Color3f, f90: mi.Color3f) -> mi.Color3f:
        """Share of what the first bounce loses that leaves later (as above)."""
        average = energy_tables().average(self.roughness)
        fresnel = f0 + (f90 - f0) / 21  # Schlick's Fresnel term averaged over the hemisphere
        return dr.square(fresnel) * average / dr.maximum(1 - fresnel * (1 - average), 1e-6)

    def _transmitted(self, constant: mi.Float, edge: mi.Float) -> mi.Color3f:
        """What the dielectric's reflection leaves for the base; the arguments are the energy tables' entries."""
        reflected = self.dielectric_f0 * constant + self.dielectric_f90 * edge
        return 1 - reflected - self.dielectric_bounces * (1 - constant - edge)

    def _base(self, view: mi.Float, light: mi.Float) -> mi.Color3f:
        """Lambert under the dielectric's reflection (C. Kelemen and L. Szirmay-Kalos, "A Microfacet Based
        Coupled Specular-Matte BRDF Model with Importance Sampling", Eurographics 2001, section 2)."""
        energy = energy_tables()
        toward, along = (
            self._transmitted(energy.constant(cosine, self.roughness), energy.edge(cosine, self.roughness))
            for cosine in (view, light)
        )
        average = self._transmitted(energy.average_constant(self.roughness), energy.average_edge(self.roughness))
        return self.diffuse * toward * along * dr.inv_pi / dr.maximum(average, 1e-6)

    def _specular_share(self, view: mi.Float) -> mi.Float:
        white = energy_tables().white(dr.maximum(view, 1e-3), self.roughness)
        specular, diffuse = dr.mean(self.f0) * white + 0.05, dr.mean(self.diffuse) + 1e-3
        return dr.clip(specular / (specular + diffuse), 0.1, 0.9)

    def sample(self, view: mi.Vector3f, choice: mi.Float, sample: mi.Point2f) -> mi.Vector3f:
        """A direction from the visible-normal lobe or the cosine one (E. Heitz, "Sampling the GGX
        Distribution of Visible Normals", JCGT 7(4), 2018, listing 1)."""
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)
        normal, _ = distribution.sample(view, sample)
        cosine = mi.warp.square_to_cosine_hemisphere(sample)
        return dr.select(choice < self._specular_share(view.z), mi.reflect(view, normal), cosine)

    def pdf(self, view: mi.Vector3f, light: mi.Vector3f) -> mi.Float:
        """Density of `sample`, 1 / steradian."""
        half = dr.normalize(view + light)
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)
        specular = distribution.pdf(view, half) / dr.maximum(4 * dr.dot(view, half), 1e-9)
        return dr.lerp(light.z * dr.inv_pi, specular, self._specular_share(view.z))
