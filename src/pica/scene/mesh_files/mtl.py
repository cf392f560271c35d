"""Materials of OBJ files: MTL (Wavefront, "Advanced Visualizer Manual", appendix B1).

With the keys for emission and metallic roughness of Clara.io's extension, which exporters write: Ke, Pr, Pm, norm.
"""

from typing import Any

from pica.scene.conversion.conversion import Conversion
from pica.scene.conversion.pictures import ChannelSource, Pictures

_OPTION_VALUES = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2}
"""The most values of options of maps; others have one."""
_READ = {"newmtl", "ka", "kd", "ks", "ke", "ns", "ni", "d", "tr", "tf", "illum", "pr", "pm"}
_READ |= {"map_kd", "map_ke", "map_pr", "map_pm", "norm", "map_bump", "bump", "map_ka", "map_ks", "map_ns"}
"""Those of the Phong model besides are not used, but need no warning."""

Lines = dict[str, list[str]]
"""The words of a material's lines by their first one in small letters."""


def parse(text: str) -> dict[str, Lines]:
    """The materials of a file by their names."""
    materials: dict[str, Lines] = {}
    for line in text.splitlines():
        key, *words = line.split() or ["#"]
        if key.lower() == "newmtl":
            materials[" ".join(words)] = {}
        elif materials and words and not key.startswith("#"):
            materials[next(reversed(materials))][key.lower()] = words
    return materials


class Materials:
    """The materials of an OBJ file, each added once, when first used."""

    def __init__(self, conversion: Conversion, pictures: Pictures, lines: dict[str, Lines]) -> None:
        self._conversion, self._pictures, self._lines = conversion, pictures, lines
        self._added: dict[str, int] = {}

    def get(self, name: str) -> int | None:
        """The index of a material; None where the file has none of that name."""
        if name in self._lines and name not in self._added:
            self._added[name] = self._conversion.asset.add("materials", self._entry(name, self._lines[name]))
        return self._added.get(name)

    def _entry(self, name: str, lines: Lines) -> dict[str, Any]:
        for key in sorted(lines.keys() - _READ):
            self._conversion.warn(f"{key} of materials is left out")
        opacity = _number(lines, "d", 1 - _number(lines, "tr", 0.0))
        exponent = max(_number(lines, "ns", 0.0), 0.0)
        # The width of the GGX lobe that matches Phong's with this exponent: alpha^2 = 2 / (exponent + 2) (Walter et al.
        # 2007, "Microfacet Models for Refraction through Rough Surfaces", 5.2); alpha is roughness squared.
        roughness = _number(lines, "pr", (2 / (exponent + 2)) ** 0.25)
        metallic = _number(lines, "pm", 0.0)
        packed = self._metallic_roughness(lines, roughness, metallic)
        base = self._texture(lines, "map_kd")
        emissive = self._texture(lines, "map_ke")
        emission = _color(lines, "ke", 1.0 if emissive else 0.0)
        strength = max(*emission, 1.0)
        ior = _number(lines, "ni", 1.5)
        return {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*map(_unit, _color(lines, "kd", 1.0)), _unit(opacity)],
                "baseColorTexture": base,
                "metallicRoughnessTexture": packed,
                "metallicFactor": 1.0 if packed else _unit(metallic),
                "roughnessFactor": 1.0 if packed else _unit(roughness),
            },
            "normalTexture": self._normal(lines),
            "emissiveTexture": emissive,
            "emissiveFactor": [max(each, 0.0) / strength for each in emission],
            "alphaMode": "BLEND" if opacity < 1 else "OPAQUE",
            "doubleSided": True,  # sides have no meaning in OBJ
            "extensions": self._conversion.asset.extensions(
                KHR_materials_emissive_strength={"emissiveStrength": strength} if strength > 1 else None,
                KHR_materials_ior={"ior": ior} if ior >= 1 and ior != 1.5 else None,
            ),
        }

    def _metallic_roughness(self, lines: Lines, roughness: float, metallic: float) -> dict[str, Any] | None:
        """One texture of both maps."""
        maps = {key: self._file(lines, key) for key in ("map_pr", "map_pm")}
        if not any(maps.values()):
            return None
        channels = [
            1.0,
            *(
                ChannelSource(*file, channel=0) if (file := maps[key]) else _unit(factor)
                for key, factor in (("map_pr", roughness), ("map_pm", metallic))
            ),
        ]
        return self._pictures.texture(self._pictures.pack(channels, "metallic roughness"))

    def _texture(self, lines: Lines, key: str) -> dict[str, Any] | None:
        file = self._file(lines, key)
        return None if file is None else self._pictures.texture(self._pictures.add(*file))

    def _normal(self, lines: Lines) -> dict[str, Any] | None:
        """A map of normals: norm, or one of normals or heights, as exporters write both as map_Bump."""
        key = next((key for key in ("norm", "map_bump", "bump") if key in lines), "norm")
        file = self._file(lines, key)
        if file is None:
            return None
        words = lines[key]
        given = words[words.index("-bm") + 1] if "-bm" in words[:-1] else "1"
        strength = float(given) if _is_number(given) else 1.0
        if key == "norm":
            return self._pictures.texture(self._pictures.add(*file))
        image, scale = self._pictures.normals(*file, strength)
        info = self._pictures.texture(image)
        return info if info is None or scale == 1 else info | {"scale": scale}

    def _file(self, lines: Lines, key: str) -> tuple[bytes, str] | None:
        """Content and name of a map's file."""
        words = list(lines.get(key, ()))
        while len(words) > 1 and words[0].startswith("-"):
            if words[0] != "-bm":
                self._conversion.warn(f"{words[0]} of {key} is left out")
            option, *words = words
            for _ in range(_OPTION_VALUES.get(option, 1)):
                if len(words) > 1 and (option not in _OPTION_VALUES or _is_number(words[0])):
                    words.pop(0)
        name = " ".join(words)
        content = self._conversion.file(name, key) if name else None
        return None if content is None else (content, name)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _number(lines: Lines, key: str, default: float) -> float:
    words = lines.get(key, ())
    return float(words[0]) if words and _is_number(words[0]) else default


def _color(lines: Lines, key: str, default: float) -> tuple[float, float, float]:
    words = lines.get(key, ())
    if not words or not all(map(_is_number, words)):
        return default, default, default
    values = [float(word) for word in words]
    return (values[0], values[1], values[2]) if len(values) >= 3 else (values[0],) * 3


def _unit(value: float) -> float:
    return min(max(value, 0.0), 1.0)
