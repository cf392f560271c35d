"""OpenUSD: hierarchy, geometry, cameras, animation and packages."""

import math
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils

import pica
from pica.scene.usd.subdivision import SHARP, Polygons, subdivide
from tests.scene.test_mesh_files import picture
from tests.scene.usd_files import bind, cube, material, place, quad, saved, stage, texture

SKY = pica.Environment(np.ones((2, 4, 3)))


def load(path: Path, **options: object) -> pica.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return pica.load(path, environment=SKY, **options)  # type: ignore[arg-type]


def node(scene: pica.Scene, name: str) -> pica.Node:
    (found,) = [each for each in scene.nodes() if each.name == name]
    return found


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_up_axis_and_unit_are_those_of_the_stage(suffix: str, tmp_path: Path) -> None:
    made = stage(tmp_path / f"a{suffix}", up="Z", unit=0.01)
    place(cube(made), 0, 0, 300)
    path = saved(made)
    np.testing.assert_allclose(load(path).bounds(), [(-0.01, 2.99, -0.01), (0.01, 3.01, 0.01)], atol=1e-6)
    np.testing.assert_allclose(load(path, up="y").bounds(), [(-0.01, -0.01, 2.99), (0.01, 0.01, 3.01)], atol=1e-6)


def test_transforms_are_composed(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    group = UsdGeom.Xform.Define(made, "/World/group")
    place(group, 1, 2, 3)
    UsdGeom.Xformable(group).AddRotateYOp().Set(90.0)
    leaf = place(quad(made, "/World/group/leaf"), 0, 0, 5)
    free = place(quad(made, "/World/group/free"), 7, 0, 0)
    UsdGeom.Xformable(free).SetResetXformStack(True)
    expected = np.array(UsdGeom.Xformable(leaf).ComputeLocalToWorldTransform(Usd.TimeCode.Default())).T
    scene = load(saved(made))
    np.testing.assert_allclose(node(scene, "leaf").world, expected, atol=1e-12)
    np.testing.assert_allclose(node(scene, "leaf").world[:3, 3], (6, 2, 3), atol=1e-12)
    np.testing.assert_allclose(node(scene, "free").world[:3, 3], (7, 0, 0), atol=1e-12)


def test_polygons_become_triangles_and_subsets_have_their_materials(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = bind(cube(made), material(made, "red", diffuseColor=(1.0, 0.0, 0.0)))
    other = material(made, "blue", diffuseColor=(0.0, 0.0, 1.0))
    subset = UsdShade.MaterialBindingAPI(mesh).CreateMaterialBindSubset("some", [0, 1], "face")
    bind(subset, other)
    UsdGeom.Mesh(mesh).CreateHoleIndicesAttr([5])
    sections = node(load(saved(made)), "cube").mesh.sections
    counts = {section.material.name: len(section.indices) for section in sections}
    assert counts == {"red": 6, "blue": 4}
    for section in sections:
        corners = section.positions[section.indices]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1)) > 0).all()


def test_left_handed_faces_are_reversed(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = quad(made)
    mesh.CreateOrientationAttr("leftHanded")
    (section,) = node(load(saved(made)), "quad").mesh.sections
    np.testing.assert_allclose(section.normals, np.tile((0, 0, -1), (len(section.normals), 1)), atol=1e-6)


def test_face_varying_primvars_split_only_where_they_differ(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(made, "/World/strip")
    mesh.CreatePointsAttr([(x, y, 0) for x in range(3) for y in range(2)])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 2, 3, 1, 2, 4, 5, 3])
    mesh.CreateNormalsAttr([(0, 0, 1)] * 6)
    mesh.SetNormalsInterpolation("vertex")
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    painted = bind(mesh, material(made, "painted"))
    texture(made, UsdShade.Material(made.GetPrimAtPath("/World/painted")), "diffuseColor", "a.png")
    (tmp_path / "a.png").write_bytes(picture((1, 2, 3)))
    st.Set([(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)])
    assert len(node(load(saved(made)), "strip").mesh.sections[0].positions) == 6
    st.Set([(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.9, 0), (1, 0), (1, 1), (0.9, 1)])
    (section,) = node(load(saved(made)), "strip").mesh.sections
    assert len(section.positions) == 8 and painted
    corner = section.uv0[np.argmin(np.abs(section.positions - (0, 0, 0)).sum(axis=1))]
    np.testing.assert_allclose(corner, (0, 1))  # v points down


def test_subdivision_nears_a_sphere_and_keeps_creases(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    cube(made, "/World/smooth", "catmullClark")
    creased = cube(made, "/World/creased", "catmullClark")
    creased.CreateCreaseIndicesAttr([1, 3, 7, 5, 1])
    creased.CreateCreaseLengthsAttr([5])
    creased.CreateCreaseSharpnessesAttr([10.0])
    scene = load(saved(made))
    (smooth,) = node(scene, "smooth").mesh.sections
    assert len(smooth.indices) == 6 * 16 * 2 and len(smooth.positions) == 98
    distances = np.linalg.norm(smooth.positions, axis=1)
    assert distances.min() > 0.87 and distances.max() < 0.92
    np.testing.assert_allclose(np.linalg.norm(smooth.normals, axis=1), 1, atol=1e-5)
    assert np.einsum("ij,ij->i", smooth.normals, smooth.positions).min() > 0.6
    (section,) = node(scene, "creased").mesh.sections
    assert section.positions[:, 2].max() == 1  # the sharp loop stays in its plane
    assert section.positions[:, 2].min() == pytest.approx(smooth.positions[:, 2].min(), abs=0.01)


def test_a_level_of_subdivision_is_that_of_catmull_and_clark() -> None:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
    none = np.zeros((0, 2), int), np.zeros(0)
    whole = Polygons(np.full(6, 4), faces, corners, np.arange(24.0)[:, None], np.arange(6), *none, np.zeros(8))
    once = subdivide(whole)
    # valence 3: (mean of face points + 2 mean of edge middles) / 3; edges: mean of ends and face points
    np.testing.assert_allclose(once.vertices[:8], corners * 5 / 9)
    assert sorted(np.abs(once.vertices[8]).tolist()) == [0, 0.75, 0.75]
    assert once.face.tolist() == np.repeat(np.arange(6), 4).tolist()
    assert once.corner_data[:4, 0].tolist() == [0, 0.5, 1.5, 1.5]  # corner, middles of edges, and of the face
    whole.corner_sharpness = np.where(np.arange(8) == 7, SHARP, 0.0)
    np.testing.assert_allclose(subdivide(whole).vertices[7], (1, 1, 1))
    square = corners[[0, 2, 6, 4]]
    alone = Polygons(np.array([4]), np.arange(4), square, np.zeros((4, 0)), np.zeros(1, int), *none, np.zeros(4))
    np.testing.assert_allclose(subdivide(alone).vertices[:4], alone.vertices)  # corners of a boundary


@pytest.mark.parametrize("kind", ["Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane"])
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_primitives_have_their_extent_and_face_outwards(kind: str, axis: str, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    prim = getattr(UsdGeom, kind).Define(made, "/World/prim")
    if kind not in ("Sphere", "Cube"):
        prim.CreateAxisAttr(axis)
    elif axis != "Z":
        pytest.skip("has no axis")
    extent = np.array(prim.ComputeExtentFromPlugins(prim, Usd.TimeCode.Default()))
    (section,) = node(load(saved(made)), "prim").mesh.sections
    np.testing.assert_allclose([section.positions.min(axis=0), section.positions.max(axis=0)], extent, atol=1e-3)
    corners = section.positions[section.indices]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    towards = section.normals[section.indices].mean(axis=1)
    assert np.einsum("ij,ij->i", faces, towards).min() > 0
    if kind != "Plane":
        assert np.einsum("ij,ij->i", faces, corners.mean(axis=1)).min() > 0


def test_instances_share_a_mesh(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    source = made.CreateClassPrim("/Chair")
    cube(made, "/Chair/seat")
    for number in range(3):
        prim = place(UsdGeom.Xform.Define(made, f"/World/chair{number}"), number, 0, 0).GetPrim()
        prim.GetReferences().AddInternalReference(source.GetPath())
        prim.SetInstanceable(number < 2)
    meshes = [each.mesh for each in load(saved(made)).nodes() if each.mesh]
    assert len(meshes) == 3 and len(set(map(id, meshes))) == 1


def test_point_instancers(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    instancer = place(UsdGeom.PointInstancer.Define(made, "/World/many"), 0, 10, 0)
    for name in ("ball", "box"):
        kind = UsdGeom.Sphere if name == "ball" else UsdGeom.Cube
        instancer.CreatePrototypesRel().AddTarget(place(kind.Define(made, f"/World/many/{name}"), 0, 0, 1).GetPath())
    instancer.CreateProtoIndicesAttr([0, 1, 0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)])
    instancer.CreateOrientationsAttr([Gf.Quath(1), Gf.Quath(0, 1, 0, 0), Gf.Quath(1), Gf.Quath(1)])
    instancer.CreateScalesAttr([(1, 1, 1), (1, 1, 1), (2, 2, 2), (1, 1, 1)])
    instancer.CreateInvisibleIdsAttr([3])
    scene = load(saved(made))
    balls, boxes = (node(scene, name).instance_transforms()[:, :3, 3] for name in ("ball", "box"))
    np.testing.assert_allclose(balls, [(0, 10, 1), (2, 10, 2)], atol=1e-5)
    np.testing.assert_allclose(boxes, [(1, 10, -1)], atol=1e-3)


def test_invisible_prims_and_other_purposes_are_not_shown(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    quad(made, "/World/shown")
    UsdGeom.Imageable(UsdGeom.Xform.Define(made, "/World/hidden")).MakeInvisible()
    quad(made, "/World/hidden/below")
    quad(made, "/World/proxy").CreatePurposeAttr("proxy")
    made.OverridePrim("/World/off").SetActive(False)
    assert [each.name for each in load(saved(made)).nodes() if each.mesh] == ["shown"]


def test_cameras_have_the_lens_of_the_file(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda", unit=0.01)
    camera = place(UsdGeom.Camera.Define(made, "/World/lens"), 0, 0, 500)
    for name, value in (("FocalLength", 50.0), ("HorizontalAperture", 36.0), ("VerticalAperture", 24.0)):
        getattr(camera, f"Create{name}Attr")(value)
    camera.CreateFStopAttr(2.8)
    camera.CreateFocusDistanceAttr(400.0)
    camera.CreateHorizontalApertureOffsetAttr(3.6)
    flat = UsdGeom.Camera.Define(made, "/World/flat")
    flat.CreateProjectionAttr("orthographic")
    flat.CreateVerticalApertureAttr(1000.0)
    quad(made)
    lens, orthographic = load(saved(made)).cameras()
    assert lens.vertical_fov == pytest.approx(2 * math.atan(12 / 50))
    assert (lens.f_number, lens.focus_distance) == (pytest.approx(2.8), pytest.approx(4.0))
    # Film is in tenths of the unit, and so in millimetres where the unit is a centimetre.
    assert lens.sensor_height == pytest.approx(0.024) and lens.focal_length == pytest.approx(0.05)
    assert lens.principal_point == pytest.approx((0.4, 0.5))
    np.testing.assert_allclose(lens.transform[:3, 3], (0, 0, 5))
    assert orthographic.orthographic_height == pytest.approx(1.0)


@pytest.mark.parametrize("rotation", [False, True])
def test_animated_transforms_are_those_of_usd(rotation: bool, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    made.SetStartTimeCode(101)
    made.SetEndTimeCode(125)
    made.SetTimeCodesPerSecond(24)
    mesh = quad(made)
    move = UsdGeom.Xformable(mesh).AddTranslateOp()
    move.Set(Gf.Vec3d(0, 0, 0), 101)
    move.Set(Gf.Vec3d(4, 2, 0), 125)
    if rotation:
        turn = UsdGeom.Xformable(mesh).AddRotateXYZOp()
        turn.Set(Gf.Vec3f(0, 0, 0), 101)
        turn.Set(Gf.Vec3f(0, 300, 40), 125)
    path = saved(made)
    scene = load(path)
    (animation,) = scene.animations
    assert animation.duration == pytest.approx(1.0)
    for seconds in (0.0, 0.4, 1.0):
        scene.animate(seconds)
        expected = np.array(UsdGeom.Xformable(mesh).GetLocalTransformation(Usd.TimeCode(101 + 24 * seconds))).T
        np.testing.assert_allclose(node(scene, "quad").world, expected, atol=2e-3)


def test_a_package_has_its_textures(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    painted = material(made, "painted")
    bind(quad(made), painted)
    texture(made, painted, "diffuseColor", "maps/a.png")
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "a.png").write_bytes(picture((10, 20, 30)))
    assert UsdUtils.CreateNewUsdzPackage(str(saved(made)), str(tmp_path / "a.usdz"))
    (tmp_path / "maps" / "a.png").unlink()
    (section,) = node(load(tmp_path / "a.usdz"), "quad").mesh.sections
    assert section.material.base_color_texture.image.pixels[0, 0].tolist() == [10, 20, 30, 255]


def test_variants_and_payloads_are_as_authored(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    variants = made.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("shape")
    for name in ("one", "two"):
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            quad(made, f"/World/{name}")
    quad(other := stage(tmp_path / "payload.usda"), "/World/inside")
    saved(other)
    made.OverridePrim("/World/loaded").GetPayloads().AddPayload("./payload.usda", "/World")
    variants.SetVariantSelection("one")
    assert {each.name for each in load(saved(made)).nodes() if each.mesh} == {"one", "inside"}


def test_a_kitchen_of_a_thousand_prims(tmp_path: Path) -> None:
    made = stage(tmp_path / "kitchen.usdc", up="Z", unit=0.01)
    source = made.CreateClassPrim("/Cup")
    painted = material(made, "glaze", diffuseColor=(0.2, 0.4, 0.6))
    bind(UsdGeom.Cylinder.Define(made, "/Cup/body"), painted)
    bind(cube(made, "/Cup/handle", "catmullClark"), painted)
    for number in range(500):
        prim = place(UsdGeom.Xform.Define(made, f"/World/cup{number}"), 3 * (number % 25), 3 * (number // 25), 0)
        prim.GetPrim().GetReferences().AddInternalReference(source.GetPath())
        prim.GetPrim().SetInstanceable(True)
    path = saved(made)
    began = time.perf_counter()
    scene = load(path)
    assert time.perf_counter() - began < 20
    shown = [each for each in scene.nodes() if each.mesh]
    assert len(shown) == 1000 and len({id(each.mesh) for each in shown}) == 2


def test_what_is_left_out_is_told_once(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    quad(made)
    for name in ("hair", "fur"):
        UsdGeom.NurbsCurves.Define(made, f"/World/{name}")
        cube(made, f"/World/moving_{name}").GetPointsAttr().Set([(0, 0, 0)] * 8, 1)
        cube(made, f"/World/moving_{name}").GetPointsAttr().Set([(0, 0, 1)] * 8, 2)
        for code in (1, 2):
            UsdGeom.Camera.Define(made, f"/World/zoom_{name}").GetFocalLengthAttr().Set(10.0 * code, code)
    with pytest.warns(UserWarning) as caught:
        pica.load(saved(made), environment=SKY)
    assert [str(each.message).split(": ", 1)[1] for each in caught] == [
        "prims of type NurbsCurves are left out",
        "the motion of points is left out",
        "prims of type Camera keep the values of the start time code",
    ]


def polygons(made: Usd.Stage, *rings: list[tuple[float, float]], turned: bool = False) -> UsdGeom.Mesh:
    """Polygons in the plane z = y."""
    mesh = UsdGeom.Mesh.Define(made, "/World/polygons")
    mesh.CreatePointsAttr([(x, y, y) for ring in rings for x, y in (ring[::-1] if turned else ring)])
    mesh.CreateFaceVertexCountsAttr([len(ring) for ring in rings])
    mesh.CreateFaceVertexIndicesAttr(list(range(sum(map(len, rings)))))
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


DART = [(2.0, -1.0), (4.0, 0.0), (2.0, 1.0), (2.6, 0.0)]
COMB = [(0.0, 0.0), (7.0, 0.0), *((7 - x, y) for x in range(7) for y in ((3.0, 3.0) if x % 2 == 0 else (1.0, 1.0)))]
SQUARE = [(10.0, 0.0), (11.0, 0.0), (11.0, 1.0), (10.0, 1.0)]


@pytest.mark.parametrize("turned", [False, True])
def test_polygons_that_are_not_convex_are_not_fans(turned: bool, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    polygons(made, DART, [(x + 20, y) for x, y in COMB], SQUARE, turned=turned)
    (section,) = node(load(saved(made)), "polygons").mesh.sections
    corners = section.positions[section.indices].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2

    def area(ring: list[tuple[float, float]]) -> float:
        x, y = np.array(ring).T
        return abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())) / 2

    assert areas.sum() == pytest.approx(math.sqrt(2) * (area(DART) + area(COMB) + 1), rel=1e-5)
    assert (normals[:, 2] * (-1 if turned else 1) >= 0).all()
    # The middle of the fan's second triangle is outside the dart.
    assert not any(inside(each, (2.1, 0.0)) for each in corners[..., :2])


def inside(triangle: np.ndarray, place: tuple[float, float]) -> bool:
    edges, arms = np.roll(triangle, -1, axis=0) - triangle, np.array(place) - triangle
    signs = edges[:, 0] * arms[:, 1] - edges[:, 1] * arms[:, 0]
    return bool((signs > 0).all() or (signs < 0).all())
