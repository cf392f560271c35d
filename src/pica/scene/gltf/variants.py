"""KHR_materials_variants: other materials of primitives, by a name for all of the file."""

from pica.errors import SceneError, shown
from pica.names import did_you_mean
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element

_EXTENSION = "KHR_materials_variants"


class Variants:
    """The variants of a file, one of which, or none, is shown. Raises SceneError if that is not in the file."""

    def __init__(self, document: Document) -> None:
        entries = document.root.extension(_EXTENSION).objects("variants")
        self.names = tuple(entry.name for entry in entries)
        self._shown = None if document.variant is None else self._index(document.variant)

    def _index(self, name: str) -> int:
        if name in self.names:
            return self.names.index(name)
        others = did_you_mean(name, self.names) or f"; there are {', '.join(map(shown, self.names)) or 'none'}"
        raise SceneError(f"no variant {shown(name)}{others}")

    def choose(self, primitive: Element) -> Element:
        """The object whose "material" the primitive has: a mapping to the variant, or itself."""
        if self._shown is not None and primitive.has_extension(_EXTENSION):
            for mapping in primitive.extension(_EXTENSION).objects("mappings"):
                if self._shown in mapping.integers("variants"):
                    return mapping
        return primitive
