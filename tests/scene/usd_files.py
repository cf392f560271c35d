"""Small stages for the tests."""

from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

_TYPES = Sdf.ValueTypeNames


def stage(path: Path, up: str = "Y", unit: float = 1.0) -> Usd.Stage:
    """A new stage."""
    made: Usd.Stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(made, up)
    UsdGeom.SetStageMetersPerUnit(made, unit)
    made.SetDefaultPrim(UsdGeom.Xform.Define(made, "/World").GetPrim())
    return made


def saved(made: Usd.Stage) -> Path:
    """The stage's file."""
    made.GetRootLayer().Save()
    return Path(made.GetRootLayer().realPath)


def material(made: Usd.Stage, name: str, shader: str = "UsdPreviewSurface", **inputs: Any) -> UsdShade.Material:
    """A material of one shader with inputs."""
    result = UsdShade.Material.Define(made, f"/World/{name}")
    surface = UsdShade.Shader.Define(made, f"/World/{name}/surface")
    surface.CreateIdAttr(shader)
    for key, value in inputs.items():
        kind = _TYPES.Color3f if isinstance(value, tuple) else _TYPES.Bool if isinstance(value, bool) else _TYPES.Float
        surface.CreateInput(key, kind).Set(value)
    result.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    return result


def texture(made: Usd.Stage, of: UsdShade.Material, key: str, file: str, output: str = "rgb", **inputs: Any) -> Any:
    """Connect an input of a material's shader to a texture; returns the texture."""
    path = of.GetPath()
    reader = UsdShade.Shader.Define(made, path.AppendChild("st"))
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", _TYPES.String).Set("st")
    sampler = UsdShade.Shader.Define(made, path.AppendChild(f"texture_{key}"))
    sampler.CreateIdAttr("UsdUVTexture")
    sampler.CreateInput("file", _TYPES.Asset).Set(file)
    sampler.CreateInput("st", _TYPES.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    for name, value in inputs.items():
        sampler.CreateInput(name, _TYPES.Float4 if isinstance(value, tuple) else _TYPES.Token).Set(value)
    surface = UsdShade.Shader(made.GetPrimAtPath(path.AppendChild("surface")))
    kind = _TYPES.Float3 if output == "rgb" else _TYPES.Float
    surface.CreateInput(key, kind).ConnectToSource(sampler.ConnectableAPI(), output)
    return sampler


def bind(prim: Any, to: UsdShade.Material) -> Any:
    """Bind a material."""
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(to)
    return prim


def place(prim: Any, x: float, y: float, z: float) -> Any:
    """Translate a prim."""
    UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(x, y, z))
    return prim


def quad(made: Usd.Stage, path: str = "/World/quad", size: float = 1.0) -> UsdGeom.Mesh:
    """A square of two metres in the XY plane, with st."""
    mesh = UsdGeom.Mesh.Define(made, path)
    mesh.CreatePointsAttr([(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    mesh.CreateSubdivisionSchemeAttr("none")
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", _TYPES.TexCoord2fArray, "faceVarying")
    st.Set([(0, 0), (1, 0), (1, 1), (0, 1)])
    return mesh


def cube(made: Usd.Stage, path: str = "/World/cube", scheme: str = "none") -> UsdGeom.Mesh:
    """A cube of two metres."""
    mesh = UsdGeom.Mesh.Define(made, path)
    mesh.CreatePointsAttr([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
    mesh.CreateSubdivisionSchemeAttr(scheme)
    return mesh
