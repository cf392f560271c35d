"""The stage: its layers, and the files that it names, with the same rules as a glTF file's."""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom

from pica.errors import SceneError, shown
from pica.scene.conversion.conversion import Conversion

_MATERIALX, _IN_MEMORY = ".mtlx", ".of-pica.usda"
"""Suffixes of documents of MaterialX, and of the layers that are made of them."""


class Stage:
    """An open stage at its first time code. Raises SceneError for layers outside the file's folder."""

    def __init__(self, conversion: Conversion) -> None:
        self.conversion = conversion
        self._folder = conversion.path.parent.resolve()
        self._documents: dict[str, Sdf.Layer | None] = {}
        self._layers = self._checked_layers()
        self.usd: Usd.Stage = Usd.Stage.Open(self._layers[0], Usd.Stage.LoadAll)
        self.start = self.usd.GetStartTimeCode() if self.usd.HasAuthoredTimeCodeRange() else 0.0
        self.time = Usd.TimeCode(self.start)
        self.codes_per_second = self.usd.GetTimeCodesPerSecond() or 24.0
        own_up = "z" if UsdGeom.GetStageUpAxis(self.usd) == UsdGeom.Tokens.z else "y"
        self.up = conversion.given_up or own_up
        """The axis that points up, "y" or "z"."""
        self._transforms = UsdGeom.XformCache(self.time)
        about = self.usd.GetRootLayer().customLayerData
        conversion.asset.describe(_text(about.get("copyright")), _text(about.get("creator")))
        left_out = [found for found, layer in self._documents.items() if layer is None]
        for text in map(str, self.usd.GetCompositionErrors()):
            if not any(found in text for found in left_out):  # which was told
                conversion.warn(f"composition: {text.splitlines()[0]}")

    def world(self, prim: Usd.Prim) -> NDArray[np.float64]:
        """(4, 4) a prim to the stage's space, for row vectors."""
        return np.array(self._transforms.GetLocalToWorldTransform(prim))

    def _checked_layers(self) -> list[Sdf.Layer]:
        """The root layer and all that it refers to, each checked before it is opened."""
        path = self._folder / self.conversion.path.name
        self.conversion.files.admit(self.conversion.path.name, "the file")
        root = Sdf.Layer.FindOrOpen(str(path))
        if root is None:
            raise SceneError("cannot be read as USD")
        layers, known = [root], {root.identifier}
        for layer in layers:
            _check_clips(layer)
            for name in layer.GetCompositionAssetDependencies():
                found = layer.ComputeAbsolutePath(name)
                if name.lower().endswith(_MATERIALX):
                    self._use_document(layer, name, found)
                    continue
                if not name or found in known:
                    continue
                known.add(found)
                other = self._layer(name, found)
                if other is not None:
                    layers.append(other)
        return layers

    def _use_document(self, layer: Sdf.Layer, name: str, found: str) -> None:
        """Let a layer refer to a document of MaterialX as a layer beside it, which is in memory alone."""
        if found not in self._documents:
            self._documents[found] = self._document(name, found)
        if self._documents[found] is not None:
            layer.UpdateCompositionAssetDependency(name, name + _IN_MEMORY)

    def _document(self, name: str, found: str) -> Sdf.Layer | None:
        """The layer of a document; None, with a warning, where it cannot be read."""
        what = f"document {shown(name)}"
        try:
            from pica.scene.usd.materialx_files import write_layer
        except ModuleNotFoundError:
            self.conversion.warn(f'{what} needs the package MaterialX: pip install "pica[usd]"; left out')
            return None
        if Ar.IsPackageRelativePath(found):
            self.conversion.warn(f"{what}: is in a package, from which documents are not read; left out")
            return None
        content = self.content(name, str(Ar.GetResolver().Resolve(found)), "document")
        if content is None:
            return None
        layer = Sdf.Layer.New(Sdf.FileFormat.FindByExtension("usda"), found + _IN_MEMORY)
        try:
            write_layer(self.conversion, layer, content)
        except SceneError as error:
            self.conversion.warn(f"{what}: {error}; left out")
            return None
        return layer

    def _layer(self, name: str, found: str) -> Sdf.Layer | None:
        what = f"layer {shown(name)}"
        if Path(name).is_absolute() or "://" in name:
            raise SceneError(f"{what} is not a path relative to the file")
        asset = Sdf.Layer.SplitIdentifier(found)[0]
        file = str(Ar.GetResolver().Resolve(asset))  # as USD finds it
        if Ar.IsPackageRelativePath(file):
            file = Ar.SplitPackageRelativePathOuter(file)[0]
        if not file:
            self.conversion.warn(f"{what}: no such file; left out")
            return None
        self.conversion.files.admit(os.path.relpath(file, self._folder), what)
        return Sdf.Layer.FindOrOpen(found)

    def file(self, attribute: Usd.Attribute, asset: Sdf.AssetPath, what: str) -> bytes | None:
        """The content of a file that an attribute names; None, with a warning, where it cannot be read."""
        name, found = asset.path, asset.resolvedPath
        if not found and "\\" in name:  # as written on Windows
            layer = attribute.GetPropertyStack(self.time)[0].layer
            name = name.replace("\\", "/")
            found = str(Ar.GetResolver().Resolve(layer.ComputeAbsolutePath(name)))
        return self.content(name, found, what) if name else None

    def content(self, name: str, found: str, what: str) -> bytes | None:
        """Likewise, of a file by the name that the attribute has for it, and by what USD resolves it to."""
        what = f"{what}: {shown(name)}"
        try:
            if Path(name).is_absolute() or "://" in name:
                raise SceneError(f"{what} is not a path relative to the file")
            if not found:
                raise SceneError(f"{what}: no such file")
            if not Ar.IsPackageRelativePath(found):
                return self.conversion.files.read_relative(os.path.relpath(found, self._folder), what)
            outer, _ = Ar.SplitPackageRelativePathOuter(found)
            self.conversion.files.admit(os.path.relpath(outer, self._folder), what)
            opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(found))
            if opened is None:
                raise SceneError(f"{what}: cannot be read")
            self.conversion.budget.take(bytes=opened.GetSize())
            return bytes(opened.GetBuffer())
        except SceneError as error:
            self.conversion.warn(f"{error}; left out")
            return None


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _check_clips(layer: Sdf.Layer) -> None:
    """Raises SceneError for value clips, whose layers USD would open when it reads values."""

    def check(path: Sdf.Path) -> None:
        if path.IsPrimPath() or path.IsPrimVariantSelectionPath():
            spec = layer.GetPrimAtPath(path)
            if spec is not None and any(spec.HasInfo(name) for name in ("clips", "clipSets")):
                raise SceneError(f"{path}: has value clips, which are not read; flatten the stage")

    layer.Traverse(Sdf.Path.absoluteRootPath, check)
