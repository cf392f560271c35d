"""Textures whose files are tiles of UDIM."""

from pxr import Usd, UsdShade

from pica.scene.conversion.pictures import Pictures
from pica.scene.conversion.udim import PATTERN, Joined, joined
from pica.scene.usd.stage import Stage


class TiledTextures:
    """The textures of a stage, each put together once."""

    def __init__(self, stage: Stage, pictures: Pictures) -> None:
        self._stage, self._pictures = stage, pictures
        self._joined: dict[tuple[str, ...], Joined | None] = {}

    def get(self, attribute: Usd.Attribute, name: str) -> Joined | None:
        """The texture of an attribute that names a file with <UDIM>; None, with a warning, where it has no tiles."""
        layer = attribute.GetPropertyStack(self._stage.time)[0].layer
        found = UsdShade.UdimUtils.ResolveUdimTilePaths(name, layer)
        key = tuple(path for path, _ in found)
        if key not in self._joined:
            self._joined[key] = self._read({int(tile): path for path, tile in found}, name)
        return self._joined[key]

    def _read(self, paths: dict[int, str], name: str) -> Joined | None:
        if not paths:
            self._stage.conversion.warn(f"texture: '{name}' has no tiles; left out")
        names = {tile: name.replace(PATTERN, str(tile)) for tile in paths}
        read = {tile: self._stage.content(names[tile], path, "texture") for tile, path in paths.items()}
        tiles = {tile: content for tile, content in read.items() if content is not None}
        return joined(self._stage.conversion, self._pictures, tiles, name) if tiles else None
