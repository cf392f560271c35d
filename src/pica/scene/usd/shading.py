"""Networks of shaders: the value of an input, or the texture that it reads."""

import math
from typing import Any, NamedTuple

from pxr import Gf, Sdf, UsdShade

from pica.scene.conversion.udim import PATTERN
from pica.scene.usd.stage import Stage
from pica.scene.usd.surface import Map, Transform
from pica.scene.usd.udim import TiledTextures

_CLAMP, _MIRROR, _REPEAT = 33071, 33648, 10497
_WRAPS = {
    "clamp": _CLAMP, "mirror": _MIRROR, "repeat": _REPEAT, "periodic": _REPEAT, "black": _CLAMP, "constant": _CLAMP,
}  # fmt: skip
_DEEPEST = 32
"""Nodes between an input and its texture."""


class _Picture(NamedTuple):
    content: bytes
    """Of its file."""
    name: str
    tiles: Transform | None = None
    """How coordinates are transformed for one of UDIM tiles."""


class Network:
    """The shaders of one material."""

    def __init__(self, stage: Stage, shader: UsdShade.Shader, tiled: TiledTextures) -> None:
        self._stage, self._shader, self._tiled = stage, shader, tiled
        self._time = stage.time
        self.vertex_colors = False
        """Whether an input reads the primvar displayColor."""

    def value(self, name: str, default: Any, convert: Any = float) -> Any:
        """The value of an input, or the Map that it is connected to; `convert` is for values."""
        return self._input(self._shader, name, default, convert)

    def color(self, name: str, default: Any) -> Any:
        """As `value`."""
        return self.value(name, default, lambda given: tuple(float(each) for each in given)[:3])

    def number(self, name: str, default: float) -> float:
        """The value of an input; a texture there is left out."""
        value = self.value(name, default)
        return self._without_map(name, value, default)

    def plain_color(self, name: str, default: Any) -> Any:
        """Likewise."""
        return self._without_map(name, self.color(name, default), default)

    def pair(self, name: str, default: tuple[float, float]) -> tuple[float, float]:
        """Two numbers."""
        value = self.value(name, default, lambda given: (float(given[0]), float(given[1])))
        u, v = self._without_map(name, value, default)
        return u, v

    def file_map(self, name: str, output: str, transform: Transform | None) -> Map | None:
        """The texture of an input that names a file, as those of MDL do; None without one."""
        picture = self._file(self._shader, name)
        if picture is None:
            return None
        space = str(self._shader.GetInput(name).GetAttr().GetColorSpace() or "")
        encoding = {"raw": "linear", "sRGB": "srgb"}.get(space)
        return self._map(picture, "st", transform, (_REPEAT, _REPEAT), output=output, encoding=encoding)

    def _without_map(self, name: str, value: Any, default: Any) -> Any:
        if isinstance(value, Map):
            self._stage.conversion.warn(f"textures of {name} are left out")
            return default
        return value

    def _input(self, shader: UsdShade.Shader, name: str, default: Any, convert: Any) -> Any:
        given = shader.GetInput(name)
        if not given:
            return default
        sources = UsdShade.Utils.GetValueProducingAttributes(given)
        attribute = sources[0] if sources else None
        if attribute is None:
            return default
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            return self._of_node(UsdShade.Shader(attribute.GetPrim()), attribute.GetName(), default, 0)
        value = attribute.Get(self._time)
        try:
            return default if value is None else convert(value)
        except (TypeError, ValueError):
            return default

    def _of_node(self, shader: UsdShade.Shader, output: str, default: Any, depth: int) -> Any:
        """What a node gives."""
        kind = str(shader.GetIdAttr().Get() or "")
        if kind == "UsdUVTexture":
            return self._uv_texture(shader, output.removeprefix("outputs:")) or default
        if kind.startswith(("ND_image_", "ND_tiledimage_", "ND_UsdUVTexture")):
            return self._image(shader, output.removeprefix("outputs:")) or default
        if kind.startswith("UsdPrimvarReader") or kind.startswith("ND_geompropvalue"):
            name = self._text(shader, "varname") or self._text(shader, "geomprop")
            if name == "displayColor":
                self.vertex_colors = True
                return default if isinstance(default, float) else (1.0, 1.0, 1.0)
            self._stage.conversion.warn(f"the primvar {name!r} of materials is left out")
            return default
        if depth < _DEEPEST and kind.startswith(
            ("ND_normalmap", "ND_extract", "ND_convert", "ND_swizzle", "ND_separate")
        ):
            given = self._connected(shader, "in")
            if given is not None:
                inner = self._of_node(given[0], given[1], default, depth + 1)
                index = self._input(shader, "index", 0, int)
                if isinstance(inner, Map) and kind.startswith("ND_extract") and isinstance(index, int):
                    return inner._replace(output="rgba"[min(max(index, 0), 3)])
                last = output.removeprefix("outputs:").removeprefix("out")
                return inner._replace(output=last) if isinstance(inner, Map) and last in ("r", "g", "b", "a") else inner
        if depth < _DEEPEST and kind.startswith("ND_multiply"):
            given = self._connected(shader, "in1")
            inner = None if given is None else self._of_node(given[0], given[1], default, depth + 1)
            factor = self._input(
                shader, "in2", 1.0, lambda x: tuple(map(float, x)) if hasattr(x, "__len__") else float(x)
            )
            if isinstance(inner, Map) and not isinstance(factor, Map):
                factors = (factor,) * 3 if isinstance(factor, float) else (*factor, 1.0, 1.0)[:3]
                return inner._replace(
                    scale=(*(a * b for a, b in zip(inner.scale, factors, strict=False)), inner.scale[3])
                )
        self._stage.conversion.warn(f"shader nodes of type {kind or 'none'} are left out")
        return default

    def _connected(self, shader: UsdShade.Shader, name: str) -> tuple[UsdShade.Shader, str] | None:
        """The node and output that an input is connected to."""
        given = shader.GetInput(name)
        for attribute in UsdShade.Utils.GetValueProducingAttributes(given) if given else ():
            if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
                return UsdShade.Shader(attribute.GetPrim()), str(attribute.GetName())
        return None

    def _text(self, shader: UsdShade.Shader, name: str) -> str:
        value = self._input(shader, name, "", str)
        return value if isinstance(value, str) else ""

    def _uv_texture(self, shader: UsdShade.Shader, output: str) -> Map | None:
        """Of UsdUVTexture (UsdPreviewSurface Proposal, "Texture Reader")."""
        found = self._file(shader)
        if found is None:
            return None
        space = self._text(shader, "sourceColorSpace")
        vector = lambda given: tuple(float(each) for each in given)[:4]  # noqa: E731
        uv, transform = self._coordinates(shader, "st")
        wraps = [_WRAPS.get(self._text(shader, f"wrap{axis}"), _REPEAT) for axis in "ST"]
        return self._map(
            found,
            uv,
            transform,
            (wraps[0], wraps[1]),
            output=output,
            scale=self._input(shader, "scale", (1.0, 1.0, 1.0, 1.0), vector),
            bias=self._input(shader, "bias", (0.0, 0.0, 0.0, 0.0), vector),
            encoding={"raw": "linear", "sRGB": "srgb"}.get(space),
        )

    def _image(self, shader: UsdShade.Shader, output: str) -> Map | None:
        """Of MaterialX' image and tiledimage (MaterialX Specification 1.39, "Texture Nodes")."""
        found = self._file(shader)
        if found is None:
            return None
        uv, transform = self._coordinates(shader, "texcoord")
        space = str(shader.GetInput("file").GetAttr().GetColorSpace() or "")
        tiling = self._input(shader, "uvtiling", None, lambda given: tuple(float(each) for each in given)[:2])
        if isinstance(tiling, tuple) and len(tiling) == 2:
            transform = _combined((tiling[0], 0.0, 0.0, 0.0, tiling[1], 0.0), transform)
        wraps = [_WRAPS.get(self._text(shader, f"{axis}addressmode"), _REPEAT) for axis in "uv"]
        encoding = None if not space else "srgb" if "srgb" in space.lower() else "linear"
        channel = output if output in ("r", "g", "b", "a") else "rgb"
        return self._map(found, uv, transform, (wraps[0], wraps[1]), output=channel, encoding=encoding)

    def _file(self, shader: UsdShade.Shader, name: str = "file") -> _Picture | None:
        """The picture that an input names."""
        asset = self._input(shader, name, None, lambda given: given)
        if not isinstance(asset, Sdf.AssetPath):
            return None
        attribute = UsdShade.Utils.GetValueProducingAttributes(shader.GetInput(name))[0]
        if PATTERN in asset.path:
            joined = self._tiled.get(attribute, asset.path.replace("\\", "/"))
            return None if joined is None else _Picture(joined.content, asset.path, joined.transform)
        content = self._stage.file(attribute, asset, "texture")
        return None if content is None else _Picture(content, asset.path)

    def _map(self, picture: _Picture, uv: str, transform: Transform | None, wraps: tuple[int, int], **more: Any) -> Map:
        """A map of a picture; tiles together cover their part of the coordinates, and clamp."""
        if picture.tiles is not None:
            transform, wraps = _combined(transform, picture.tiles), (_CLAMP, _CLAMP)
        return Map(picture.content, picture.name, uv=uv, transform=transform, wraps=wraps, **more)

    def _coordinates(self, shader: UsdShade.Shader, name: str) -> tuple[str, Transform | None]:
        """The primvar of texture coordinates, and how they are transformed."""
        transform: Transform | None = None
        found = self._connected(shader, name)
        for _ in range(_DEEPEST):
            if found is None:
                break
            node, kind = found[0], str(found[0].GetIdAttr().Get() or "")
            if kind in ("UsdTransform2d", "ND_UsdTransform2d") or kind.startswith("ND_place2d"):
                transform = _combined(self._transform(node, kind), transform)
                found = self._connected(node, "texcoord" if kind.startswith("ND_place2d") else "in")
                continue
            if kind.startswith("ND_texcoord"):
                break
            return self._text(node, "varname") or self._text(node, "geomprop") or "st", transform
        return "st", transform

    def _transform(self, node: UsdShade.Shader, kind: str) -> Transform:
        """Scale, then rotation, then translation; place2d divides by its scale and turns the other way."""
        pair = lambda given: tuple(float(each) for each in given)[:2]  # noqa: E731
        is_place = kind.startswith("ND_place2d")
        shift = self._input(node, "offset" if is_place else "translation", (0.0, 0.0), pair)
        scale = self._input(node, "scale", (1.0, 1.0), pair)
        angle = math.radians(self._input(node, "rotate" if is_place else "rotation", 0.0, float))
        if is_place:
            scale = tuple(1 / each if each else 1.0 for each in scale)
            shift, angle = tuple(-each for each in shift), -angle
        c, s = math.cos(angle), math.sin(angle)
        return (c * scale[0], -s * scale[1], shift[0], s * scale[0], c * scale[1], shift[1])


def _combined(first: Transform | None, then: Transform | None) -> Transform | None:
    """The transform `first`, and then another one."""
    if first is None or then is None:
        return first or then
    a = Gf.Matrix3d(first[0], first[1], first[2], first[3], first[4], first[5], 0, 0, 1)
    b = Gf.Matrix3d(then[0], then[1], then[2], then[3], then[4], then[5], 0, 0, 1)
    m = b * a
    return (m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2])
