"""Materials: the surfaces of shaders become glTF's materials and extensions."""

import math
from typing import Any, NamedTuple

from pxr import Sdf, Usd, UsdShade

from pica.scene.conversion.pictures import ChannelSource, Pictures
from pica.scene.gltf_export.container import differing
from pica.scene.usd import materialx, omni_pbr, preview_surface
from pica.scene.usd.shading import Network
from pica.scene.usd.stage import Stage
from pica.scene.usd.surface import Color, Map, Surface, Transform
from pica.scene.usd.udim import TiledTextures

_UV_SETS = 2
_READERS = {
    **dict.fromkeys(preview_surface.IDS, preview_surface.read_preview_surface),
    materialx.STANDARD_SURFACE: materialx.read_standard_surface,
    materialx.OPEN_PBR: materialx.read_open_pbr,
    **dict.fromkeys(omni_pbr.NAMES, omni_pbr.read_omni_pbr),
}
_UNBOUND = Surface(roughness=1.0, takes_colors=True)
_BLACK: Color = (0.0, 0.0, 0.0)


class BoundMaterial(NamedTuple):
    """A material of the file, and what it takes from meshes."""

    number: int
    with_opacity: int | None
    """Another one, for geometry with displayOpacity."""
    uv_names: tuple[str, ...]
    """Primvars of its texture coordinates, in glTF's order."""
    takes_colors: bool


class Materials:
    """The materials of a stage, each added once for either number of sides."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._asset = stage, stage.conversion.asset
        self._pictures = Pictures(stage.conversion)
        self._tiled = TiledTextures(stage, self._pictures)
        self._surfaces: dict[Sdf.Path, Surface] = {}
        self._bound: dict[tuple[Sdf.Path | None, bool], BoundMaterial] = {}

    def bound(self, prim: Usd.Prim, two_sided: bool) -> BoundMaterial:
        """What is bound to a prim; white with its displayColor where nothing is."""
        binding = UsdShade.MaterialBindingAPI(prim)
        material, _ = binding.ComputeBoundMaterial(UsdShade.Tokens.full)
        if not material:
            material, _ = binding.ComputeBoundMaterial(UsdShade.Tokens.preview)
        path = material.GetPath() if material else None
        if (path, two_sided) not in self._bound:
            surface = self._surface(material) if material else _UNBOUND
            self._bound[path, two_sided] = self._added(
                material.GetPrim().GetName() if material else "", surface, two_sided
            )
        return self._bound[path, two_sided]

    def _surface(self, material: UsdShade.Material) -> Surface:
        path = material.GetPath()
        if path not in self._surfaces:
            self._surfaces[path] = self._read(material)
        return self._surfaces[path]

    def _read(self, material: UsdShade.Material) -> Surface:
        found = ""
        for context in ("", "mtlx", "mdl"):
            shader = material.ComputeSurfaceSource(context)[0]
            kind = _kind(shader) if shader else ""
            if kind in _READERS:
                if material.GetDisplacementOutput().HasConnectedSource():
                    self._stage.conversion.warn("displacement is left out")
                return _READERS[kind](Network(self._stage, shader, self._tiled))
            found = found or kind
        what = f"its shader {found!r} is not read" if found else "it has no surface that is read"
        self._stage.conversion.warn(f"{material.GetPath()}: {what}; the material is white")
        return _UNBOUND

    def _added(self, name: str, surface: Surface, two_sided: bool) -> BoundMaterial:
        uv_names = tuple(dict.fromkeys(each.uv for each in surface.maps()))
        if len(uv_names) > _UV_SETS:
            self._stage.conversion.warn(
                f"material {name!r}: textures by the primvar {uv_names[2]!r} use {uv_names[0]!r}"
            )
        writer = _Writer(self._stage, self._pictures, uv_names[:_UV_SETS])
        entry = writer.entry(name, surface) | {"doubleSided": two_sided}
        index = self._asset.add("materials", entry)
        blended = self._asset.add("materials", entry | {"alphaMode": "BLEND"}) if surface is _UNBOUND else None
        return BoundMaterial(index, blended, uv_names[:_UV_SETS], surface.takes_colors)


class _Writer:
    """Writes the entry of one material."""

    def __init__(self, stage: Stage, pictures: Pictures, uv_names: tuple[str, ...]) -> None:
        self._stage, self._asset, self._pictures, self._uv_names = stage, stage.conversion.asset, pictures, uv_names

    def entry(self, name: str, surface: Surface) -> dict[str, Any]:
        """A material of glTF."""
        base_color, base_texture = self._base(surface)
        metallic, roughness, packed = self._metallic_roughness(surface)
        emission, emissive_texture, strength = self._emission(surface)
        # A surface that lets some light pass is blended; opaque ones of UsdPreviewSurface have an opacity of 1.
        transparent = isinstance(surface.opacity, Map) or surface.opacity < 1
        mode = "MASK" if transparent and surface.cutoff > 0 else "BLEND" if transparent else "OPAQUE"
        return {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*base_color, 1.0 if isinstance(surface.opacity, Map) else _unit(surface.opacity)],
                "baseColorTexture": base_texture,
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
                "metallicRoughnessTexture": packed,
            },
            "normalTexture": self._normal(surface.normal),
            "occlusionTexture": self._single(surface.occlusion, 0),
            "emissiveTexture": emissive_texture,
            "emissiveFactor": list(emission),
            "alphaMode": mode,
            **({"alphaCutoff": surface.cutoff} if mode == "MASK" else {}),
            "extensions": self._extensions(surface, strength, base_color, base_texture),
            "extras": self._asset.extras({}, differing(absorption=(list(surface.absorption), [0.0, 0.0, 0.0]))),
        }

    def _extensions(
        self, surface: Surface, strength: float, base: Color, texture: dict[str, Any] | None
    ) -> dict[str, Any]:
        film = surface.film_weight > 0 and surface.film_thickness > 0
        values: dict[str, dict[str, Any]] = {
            "emissive_strength": differing(emissiveStrength=(strength, 1.0)),
            "ior": differing(ior=(max(surface.ior, 1.0), 1.5)),
            "specular": differing(
                specularFactor=(_unit(surface.specular), 1.0),
                specularColorFactor=([max(each, 0.0) for each in surface.specular_color], [1.0, 1.0, 1.0]),
            ),
            "transmission": differing(transmissionFactor=(_unit(surface.transmission), 0.0)),
            "volume": {} if surface.thin_walled else {"thicknessFactor": 1.0},
            "dispersion": differing(dispersion=(surface.dispersion, 0.0)),
            "clearcoat": self._clearcoat(surface),
            "sheen": differing(
                sheenColorFactor=([_unit(each) for each in surface.sheen_color], [0.0, 0.0, 0.0]),
                sheenRoughnessFactor=(_unit(surface.sheen_roughness), 0.0),
            )
            if any(surface.sheen_color)
            else {},
            "iridescence": {
                "iridescenceFactor": _unit(surface.film_weight),
                "iridescenceIor": max(surface.film_ior, 1.0),
                "iridescenceThicknessMinimum": surface.film_thickness,
                "iridescenceThicknessMaximum": surface.film_thickness,
            }
            if film
            else {},
            "anisotropy": differing(
                anisotropyStrength=(_unit(surface.anisotropy), 0.0),
                anisotropyRotation=(surface.anisotropy_rotation, 0.0),
            )
            if surface.anisotropy > 0
            else {},
            "pbrSpecularGlossiness": self._specular_glossiness(surface, base, texture),
        }
        return self._asset.extensions(**{f"KHR_materials_{name}": each for name, each in values.items() if each})

    def _specular_glossiness(self, surface: Surface, base: Color, texture: dict[str, Any] | None) -> dict[str, Any]:
        if surface.specular_workflow is None:
            return {}
        roughness = surface.roughness
        if isinstance(roughness, Map):
            self._stage.conversion.warn("textures of roughness beside useSpecularWorkflow are left out")
            roughness = 0.5
        opacity = 1.0 if isinstance(surface.opacity, Map) else _unit(surface.opacity)
        return {
            "diffuseFactor": [*base, opacity],
            "specularFactor": [_unit(each) for each in surface.specular_workflow],
            "glossinessFactor": 1 - _unit(roughness),
            **({} if texture is None else {"diffuseTexture": texture}),
        }

    def _base(self, surface: Surface) -> tuple[Color, dict[str, Any] | None]:
        """The factor, and the texture with the opacity in alpha."""
        color, opacity = surface.base_color, surface.opacity
        if not isinstance(color, Map):
            factor: Color = (_unit(color[0]), _unit(color[1]), _unit(color[2]))
            if not isinstance(opacity, Map):
                return factor, None
            alpha = _channel(opacity)
            return factor, self._info(self._pictures.pack([1.0, 1.0, 1.0, alpha], f"opacity {opacity.name}"), opacity)
        factor = (_unit(color.scale[0]), _unit(color.scale[1]), _unit(color.scale[2]))
        if any(color.bias[:3]) or max(color.scale[:3]) > 1:
            self._stage.conversion.warn("bias and scales above 1 of textures of base colours are left out")
        together = isinstance(opacity, Map) and opacity.content == color.content and opacity.output == "a"
        if not isinstance(opacity, Map) or together:
            return factor, self._info(self._image(color), color)
        channels = [ChannelSource(color.content, color.name, channel) for channel in range(3)]
        return factor, self._info(self._pictures.pack([*channels, _channel(opacity)], color.name), color)

    def _metallic_roughness(self, surface: Surface) -> tuple[float, float, dict[str, Any] | None]:
        metallic, roughness = surface.metallic, surface.roughness
        if not isinstance(metallic, Map) and not isinstance(roughness, Map):
            return _unit(metallic), _unit(roughness), None
        holder = roughness if isinstance(roughness, Map) else metallic
        assert isinstance(holder, Map)
        as_they_are = all(
            not isinstance(each, Map)
            or (each.content == holder.content and each.output == channel and _is_plain(each) and each.uv == holder.uv)
            for each, channel in ((roughness, "g"), (metallic, "b"))
        )
        factors = tuple(1.0 if isinstance(each, Map) else _unit(each) for each in (metallic, roughness))
        if as_they_are and all(isinstance(each, Map) or each == 0 for each in (metallic, roughness)):
            return factors[0], factors[1], self._info(self._image(holder), holder)
        channels = [1.0, *(_channel(each) if isinstance(each, Map) else _unit(each) for each in (roughness, metallic))]
        return 1.0, 1.0, self._info(self._pictures.pack(channels, f"roughness {holder.name}"), holder)

    def _emission(self, surface: Surface) -> tuple[Color, dict[str, Any] | None, float]:
        """The factor, the texture and the strength."""
        given = surface.emission
        color = given.scale[:3] if isinstance(given, Map) else given
        color = (max(color[0], 0.0), max(color[1], 0.0), max(color[2], 0.0))
        strength = max(*color, 1.0)
        factor: Color = (color[0] / strength, color[1] / strength, color[2] / strength)
        if not isinstance(given, Map):
            return factor, None, strength
        image = self._image(given)
        return (factor if image is not None else _BLACK), self._info(image, given), strength

    def _normal(self, normal: Map | None) -> dict[str, Any] | None:
        """Of a map whose scale and bias are 2 and -1, or those by default; its scale is half of the given one."""
        if normal is None:
            return None
        scale = normal.scale[0] / 2 if normal.bias[0] < 0 else 1.0
        more = {} if math.isclose(scale, 1.0) else {"scale": scale}
        return self._info(self._image(normal), normal, **more)

    def _single(self, texture: Map | None, channel: int) -> dict[str, Any] | None:
        """Of one channel, which must be in the given one."""
        if texture is None:
            return None
        if (texture.output == "rgb" or texture.channel == channel) and _is_plain(texture):
            return self._info(self._image(texture), texture)
        channels = [_channel(texture) if each == channel else 1.0 for each in range(3)]
        return self._info(self._pictures.pack(channels, texture.name), texture)

    def _clearcoat(self, surface: Surface) -> dict[str, Any]:
        coat, roughness = surface.coat, surface.coat_roughness
        if not isinstance(coat, Map) and coat <= 0:
            return {}
        rough_map = roughness if isinstance(roughness, Map) else None
        return differing(
            clearcoatFactor=(1.0 if isinstance(coat, Map) else _unit(coat), 0.0),
            clearcoatRoughnessFactor=(1.0 if isinstance(roughness, Map) else _unit(roughness), 0.0),
            clearcoatTexture=(self._single(coat if isinstance(coat, Map) else None, 0), None),
            clearcoatRoughnessTexture=(self._single(rough_map, 1), None),
        )

    def _image(self, texture: Map) -> int | None:
        """The image of a map, which says how its colours are encoded where the file does."""
        image = self._pictures.add(texture.content, texture.name)
        if image is None or texture.encoding is None:
            return image
        return self._pictures.encoded(image, texture.encoding)

    def _info(self, image: int | None, texture: Map, **more: Any) -> dict[str, Any] | None:
        sampler = dict(zip(("wrapS", "wrapT"), texture.wraps, strict=True))
        row = self._uv_names.index(texture.uv) if texture.uv in self._uv_names else 0
        more |= {"texCoord": row} if row else {}
        if texture.transform is not None:
            more["extras"] = {"pica": {"transform": list(_pointing_down(texture.transform))}}
        return self._pictures.texture(image, sampler, **more)


def _kind(shader: UsdShade.Shader) -> str:
    """What a shader is: its identifier, or its name in a file of MDL."""
    return str(shader.GetIdAttr().Get() or shader.GetSourceAssetSubIdentifier("mdl") or "")


def _pointing_down(transform: Transform) -> Transform:
    """A transform of coordinates whose v points up, for those whose v points down: v' = 1 - v before and after."""
    a, b, shift_u, c, d, shift_v = transform
    return (a, -b, b + shift_u, -c, d, 1 - d - shift_v)


def _channel(texture: Map) -> ChannelSource:
    channel = texture.channel
    return ChannelSource(texture.content, texture.name, channel, texture.scale[channel], texture.bias[channel])


def _is_plain(texture: Map) -> bool:
    """Whether the values are those in the picture."""
    channel = texture.channel
    return texture.scale[channel] == 1 and texture.bias[channel] == 0


def _unit(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
