"""MaterialX documents (.mtlx) become layers of USD, as OpenUSD's plugin usdMtlx has them, which usd-core lacks.

A material of the document is the prim /MaterialX/Materials/NAME, with its shader and all nodes that this one reads
below it (MaterialX Specification 1.39; OpenUSD, "usdMtlx").
"""

from typing import Any

import MaterialX
import numpy as np
from pxr import Sdf, Tf, Usd, UsdShade

from pica.color import srgb_decode
from pica.errors import SceneError
from pica.scene.conversion.conversion import Conversion
from pica.scene.limits import OBJECT_BYTES
from pica.text import first_line

_ROOT = Sdf.Path("/MaterialX/Materials")
_NAMES = Sdf.ValueTypeNames
_TYPES = {
    "float": _NAMES.Float, "integer": _NAMES.Int, "boolean": _NAMES.Bool, "filename": _NAMES.Asset,
    "color3": _NAMES.Color3f, "color4": _NAMES.Color4f,
    "vector2": _NAMES.Float2, "vector3": _NAMES.Float3, "vector4": _NAMES.Float4,
}  # fmt: skip
"""Others are strings."""


def write_layer(conversion: Conversion, layer: Sdf.Layer, content: bytes) -> None:
    """Write a document's materials into a layer. Raises SceneError where it cannot be read."""
    options = MaterialX.XmlReadOptions()
    options.readXIncludeFunction = None  # it would read files from anywhere
    document = MaterialX.createDocument()
    try:
        MaterialX.readFromXmlString(document, content.decode("utf-8"), MaterialX.FileSearchPath(), options)
    except (MaterialX.Exception, MaterialX.ExceptionParseError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot be read as MaterialX ({first_line(error)})") from None
    if b"xi:include" in content:
        conversion.warn("documents that .mtlx files include are left out")
    stage = Usd.Stage.Open(layer)
    for material in document.getMaterialNodes():
        _Writer(conversion, stage).add(material)


class _Writer:
    """Writes one material."""

    def __init__(self, conversion: Conversion, stage: Usd.Stage) -> None:
        self._conversion, self._stage = conversion, stage
        self._shaders: dict[str, UsdShade.Shader] = {}
        self._waiting: list[MaterialX.Node] = []

    def add(self, material: MaterialX.Node) -> None:
        """Add a material with its nodes."""
        prim = UsdShade.Material.Define(self._stage, _ROOT.AppendChild(Tf.MakeValidIdentifier(material.getName())))
        given = material.getInput("surfaceshader")
        surface = given.getConnectedNode() if given else None
        if surface is not None:
            output = prim.CreateSurfaceOutput("mtlx")
            output.ConnectToSource(self._shader(surface, prim.GetPath()).ConnectableAPI(), "surface")
        if material.getInput("displacementshader"):
            self._conversion.warn("displacement is left out")
        while self._waiting:
            node = self._waiting.pop()
            for each in node.getInputs():
                self._add_input(self._shaders[node.getNamePath()], each, prim.GetPath())

    def _shader(self, node: MaterialX.Node, material: Sdf.Path) -> UsdShade.Shader:
        """The prim of a node, whose inputs are read later."""
        path = node.getNamePath()
        if path not in self._shaders:
            self._conversion.budget.take(bytes=OBJECT_BYTES)
            prim = UsdShade.Shader.Define(self._stage, material.AppendChild(Tf.MakeValidIdentifier(path)))
            # The names of the standard library's definitions; those of nodes with several outputs end otherwise.
            prim.CreateIdAttr(f"ND_{node.getCategory()}_{node.getType()}")
            self._shaders[path] = prim
            self._waiting.append(node)
        return self._shaders[path]

    def _add_input(self, shader: UsdShade.Shader, given: MaterialX.Input, material: Sdf.Path) -> None:
        """Connect an input, or set its value, which may be that of an input of its node graph or of a constant."""
        kind = _TYPES.get(given.getType(), _NAMES.String)
        made = shader.CreateInput(Tf.MakeValidIdentifier(given.getName()), kind)
        given = given.getInterfaceInput() or given
        node = given.getConnectedNode()
        if node is not None and node.getCategory() == "constant" and node.getInput("value"):
            given, node = node.getInput("value"), None
        if node is not None:
            of_graph = given.getConnectedOutput() if given.getNodeGraphString() else None
            output = (of_graph if of_graph is not None else given).getOutputString() or "out"
            made.ConnectToSource(self._shader(node, material).ConnectableAPI(), output)
        elif given.getType() == "filename":
            made.Set(Sdf.AssetPath(given.getResolvedValueString()))
            made.GetAttr().SetColorSpace(given.getActiveColorSpace())
        elif given.getValue() is not None:
            made.Set(_value(given))


def _value(given: MaterialX.Input) -> Any:
    """A constant; colours are linear Rec. 709."""
    value = given.getValue()
    if not given.getType().startswith(("color", "vector")):
        return value
    if given.getType().startswith("color") and "srgb" in given.getActiveColorSpace().lower():
        return (*srgb_decode(np.array(tuple(value)[:3])).tolist(), *tuple(value)[3:])
    return tuple(value)
