"""What loading OBJ and OpenUSD costs: a height field of about 100 MB in each, and a kitchen of 1,000 prims.

    PYTHONPATH=. python benchmarks/other_formats.py [--side 1000]

Prints seconds of `pica.load`: processor time of this process and of the one that converts, what passed, and the most
memory of the latter (Linux).
"""

import argparse
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

import pica

SKY = pica.Environment(np.ones((2, 4, 3)))


def height_field(side: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points, (side^2, 3), and quads."""
    x, z = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side))
    noise = 1e-3 * np.random.default_rng(1).random((side, side))
    points = np.stack([x, 0.1 * np.sin(6 * x) * np.cos(6 * z) + noise, z], axis=-1).reshape(-1, 3)
    first = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    return points.astype(np.float32), (first + np.array([0, side, side + 1, 1])).astype(np.int32)


def write_obj(path: Path, side: int) -> None:
    """Positions, texture coordinates and triangles."""
    points, quads = height_field(side)
    triangles = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]) + 1
    with path.open("w") as file:
        np.savetxt(file, points, "v %.6f %.6f %.6f")
        np.savetxt(file, points[:, [0, 2]], "vt %.5f %.5f")
        np.savetxt(file, np.repeat(triangles, 2, axis=1), "f %d/%d %d/%d %d/%d")


def write_usd(path: Path, side: int) -> None:
    """Points with normals, and face-varying texture coordinates."""
    points, quads = height_field(side)
    stage = Usd.Stage.CreateNew(str(path))
    mesh = UsdGeom.Mesh.Define(stage, "/field")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(quads), 4, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(quads.reshape(-1)))
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(points + np.float32([0, 1, 0])))
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(points[:, [0, 2]][quads.reshape(-1)])))
    stage.Save()


def write_kitchen(path: Path) -> None:
    """500 instances of two prims."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.Cylinder.Define(stage, "/Cup/body")
    UsdGeom.Cube.Define(stage, "/Cup/handle")
    stage.GetPrimAtPath("/Cup").SetSpecifier(Sdf.SpecifierClass)
    for number in range(500):
        prim = UsdGeom.Xform.Define(stage, f"/cup{number}")
        prim.AddTranslateOp().Set(Gf.Vec3d(3 * number, 0, 0))
        prim.GetPrim().GetReferences().AddInternalReference("/Cup")
        prim.GetPrim().SetInstanceable(True)
    stage.Save()


def main() -> None:
    """Load each file once."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=1000, help="points along a side of the OBJ; 1.4 times for USD")
    side = parser.parse_args().side
    with tempfile.TemporaryDirectory() as folder:
        kitchen, field, text = (Path(folder) / name for name in ("kitchen.usdc", "field.usdc", "field.obj"))
        write_kitchen(kitchen)
        write_usd(field, side * 7 // 5)
        write_obj(text, side)
        for path in (kitchen, field, text):
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            began, own = time.perf_counter(), time.process_time()
            scene = pica.load(path, environment=SKY)
            passed, own = time.perf_counter() - began, time.process_time() - own
            children = resource.getrusage(resource.RUSAGE_CHILDREN)
            print(
                f"{path.name}: {path.stat().st_size:,} bytes, {scene.triangle_count():,} triangles: {own:.2f} s here, "
                f"{children.ru_utime - before:.2f} s there, {passed:.2f} s passed, {children.ru_maxrss / 1024:,.0f} MB"
            )


if __name__ == "__main__":
    main()
