"""Skinned meshes and blend shapes of OpenUSD, against UsdSkel's own."""

import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

import pica
from pica.scene.skin import deform
from tests.scene.usd_files import place, saved, stage

SKY = pica.Environment(np.ones((2, 4, 3)))
TIMES = (0.0, 0.5, 1.0)


def arm(path: Path) -> Usd.Stage:
    """A strip along X that two joints bend, at different times, with a blend shape of two of its points."""
    made = stage(path, unit=0.5)
    made.SetStartTimeCode(10)
    made.SetEndTimeCode(34)
    root = UsdSkel.Root.Define(made, "/World/root")
    place(root, 0, 3, 0)
    mesh = UsdGeom.Mesh.Define(made, "/World/root/strip")
    points = [(x, y, 0) for x in range(5) for y in (0, 1)]
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([4] * 4)
    mesh.CreateFaceVertexIndicesAttr([i + 2 * x for x in range(4) for i in (0, 2, 3, 1)])
    mesh.CreateSubdivisionSchemeAttr("none")
    skeleton = UsdSkel.Skeleton.Define(made, "/World/root/skeleton")
    joints = ["shoulder", "shoulder/elbow"]
    skeleton.CreateJointsAttr(joints)
    at = [Gf.Matrix4d().SetTranslate(Gf.Vec3d(x, 0, 0)) for x in (0, 2)]
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(at))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([at[0], at[1]]))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0, 0.25)))
    binding.CreateJointsAttr(joints[::-1])  # an order of its own
    share = [max(0.0, min(1.0, (x - 1) / 2)) for x in range(5) for _ in (0, 1)]
    weights = [value for each in share for value in (each, 1 - each)]
    binding.CreateJointIndicesPrimvar(False, 2).Set([0, 1] * 10)
    binding.CreateJointWeightsPrimvar(False, 2).Set(weights)
    shape = UsdSkel.BlendShape.Define(made, "/World/root/strip/bulge")
    shape.CreateOffsetsAttr([(0, 1, 0), (0, 0, 2)])
    shape.CreatePointIndicesAttr([3, 8])
    binding.CreateBlendShapesAttr(["bulge"])
    binding.CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
    animation = UsdSkel.Animation.Define(made, "/World/root/skeleton/move")
    animation.CreateJointsAttr(joints)
    animation.CreateTranslationsAttr([(0, 0, 0), (2, 0, 0)])
    animation.CreateScalesAttr([Gf.Vec3h(1), Gf.Vec3h(1)])
    turns = animation.CreateRotationsAttr()
    values = animation.CreateBlendShapeWeightsAttr()
    animation.CreateBlendShapesAttr(["bulge"])
    for code, angle in ((10, 0.0), (34, 80.0)):
        each = [Gf.Quatf(Gf.Rotation(Gf.Vec3d(0, 0, 1), angle * share).GetQuat()) for share in (0.5, 1.0)]
        turns.Set(Vt.QuatfArray(each), code)
        values.Set([angle / 80], code)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    return made


def expected_points(made: Usd.Stage, time: Usd.TimeCode) -> np.ndarray:
    """(points, 3) in the world, in metres."""
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(made.GetPrimAtPath("/World/root"))
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (query,) = binding.GetSkinningTargets()
    skeleton = cache.GetSkelQuery(binding.GetSkeleton())
    points = np.array(UsdGeom.Mesh(query.GetPrim()).GetPointsAttr().Get())
    weight = skeleton.GetAnimQuery().ComputeBlendShapeWeights(time)[0]
    points[3] += (0, weight, 0)
    points[8] += (0, 0, 2 * weight)
    moved = Vt.Vec3fArray.FromNumpy(points.astype(np.float32))
    assert query.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(time), moved, time)
    world = np.array(UsdGeom.Xformable(skeleton.GetPrim()).ComputeLocalToWorldTransform(time))
    return (np.column_stack([np.array(moved), np.ones(len(moved))]) @ world)[:, :3] * 0.5


def test_skinned_and_morphed_points_are_those_of_usd_skel(tmp_path: Path) -> None:
    made = arm(tmp_path / "a.usda")
    path = saved(made)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = pica.load(path, environment=SKY)
    (strip,) = [node for node in scene.nodes() if node.mesh]
    (section,) = strip.mesh.sections
    assert strip.skin is not None and scene.animations[0].duration == pytest.approx(1.0)
    seen = []
    for seconds in TIMES:
        scene.animate(seconds)
        local = deform(section, strip)[0]
        world = strip.instance_transforms()[0]
        points = local @ world[:3, :3].T + world[:3, 3]
        wanted = expected_points(made, Usd.TimeCode(10 + 24 * seconds))
        nearest = np.linalg.norm(points[:, None] - wanted[None], axis=2)
        assert nearest.min(axis=1).max() < 1e-3 and nearest.min(axis=0).max() < 1e-3
        seen.append(points)
    assert np.abs(seen[0] - seen[2]).max() > 0.5


def test_a_skeleton_that_does_not_fit_is_one_error(tmp_path: Path) -> None:
    made = arm(tmp_path / "a.usda")
    mesh = made.GetPrimAtPath("/World/root/strip")
    UsdSkel.BindingAPI(mesh).GetJointIndicesPrimvar().Set([0, 9] * 10)
    with pytest.raises(pica.SceneError, match=r"follows joint 9 of 2"):
        pica.load(saved(made), environment=SKY)
    mesh.GetAttribute("primvars:skel:jointIndices").Set([0, 1])
    with pytest.raises(pica.SceneError, match=r"a\.usda: "):
        pica.load(saved(made), environment=SKY)
