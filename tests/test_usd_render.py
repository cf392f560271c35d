"""Materials and lights of OpenUSD look as those of pica with the same numbers."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Gf, UsdGeom, UsdLux

import pica
from pica.quality import flip
from pica.rhi.device import Device
from tests.scene.test_mesh_files import picture as png
from tests.scene.usd_files import bind, material, place, quad, saved, stage, texture

MOST = 0.01
SKY = pica.Environment(np.ones((2, 4, 3)) * (0.4, 0.5, 0.6))
SIZE = (128, 36)


def load(path: Path, environment: pica.Environment | None) -> pica.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return pica.load(path, environment=environment)


def picture(scene: pica.Scene, device: Device, camera: pica.Camera) -> np.ndarray:
    """Path traced: one program for all materials."""
    return pica.PathTracer(scene, size=SIZE, device=device).render(16, camera=camera).display / np.float32(255)


PREVIEW = {
    "rough": (
        {"diffuseColor": (0.8, 0.2, 0.1), "roughness": 0.9},
        {"base_color": (0.8, 0.2, 0.1, 1), "roughness": 0.9},
    ),
    "metal": (
        {"diffuseColor": (1.0, 0.7, 0.3), "metallic": 1.0, "roughness": 0.3},
        {"base_color": (1.0, 0.7, 0.3, 1), "metallic": 1.0, "roughness": 0.3},
    ),
    "coated": (
        {"diffuseColor": (0.1, 0.2, 0.6), "clearcoat": 1.0, "clearcoatRoughness": 0.1, "roughness": 0.8},
        {"base_color": (0.1, 0.2, 0.6, 1), "roughness": 0.8, "coats": (pica.Coat(1.0, 0.1, air_below=True),)},
    ),
    "bright": (
        {"diffuseColor": (0.0, 0.0, 0.0), "emissiveColor": (0.2, 3.0, 0.4), "ior": 1.8},
        {"base_color": (0, 0, 0, 1), "emission": (0.2, 3.0, 0.4), "roughness": 0.5, "ior": 1.8},
    ),
}
MATERIALX = {
    "standard": (
        "ND_standard_surface_surfaceshader",
        {"base": 1.0, "base_color": (0.2, 0.5, 0.3), "specular_roughness": 0.4, "metalness": 0.5},
        {"base_color": (0.2, 0.5, 0.3, 1), "roughness": 0.4, "metallic": 0.5},
    ),
    "emitter": (
        "ND_open_pbr_surface_surfaceshader",
        {"base_color": (0.1, 0.1, 0.1), "emission_luminance": 2.0, "emission_color": (1.0, 0.5, 0.25)},
        {"base_color": (0.1, 0.1, 0.1, 1), "roughness": 0.3, "emission": (2.0, 1.0, 0.5)},
    ),
    "fuzzy": (
        "ND_open_pbr_surface_surfaceshader",
        {"base_color": (0.3, 0.1, 0.1), "specular_roughness": 0.6, "fuzz_weight": 0.8, "fuzz_roughness": 0.4},
        {"base_color": (0.3, 0.1, 0.1, 1), "roughness": 0.6, "sheen": pica.Sheen((0.8, 0.8, 0.8), 0.4)},
    ),
    "glass": (
        "ND_open_pbr_surface_surfaceshader",
        {"transmission_weight": 1.0, "transmission_color": (0.5, 0.9, 0.5), "transmission_depth": 1.0,
         "specular_ior": 1.4},
        {
            "roughness": 0.3, "transmission": 1.0, "thin_walled": False, "ior": 1.4,
            "absorption": (-math.log(0.5), -math.log(0.9), -math.log(0.5)),
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["preview", "materialx"])
def test_spheres_look_as_with_materials_of_pica(kind: str, device: Device, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    expected = pica.Scene("expected", environment=SKY)
    if kind == "preview":
        given = {name: ("UsdPreviewSurface", *values) for name, values in PREVIEW.items()}
    else:
        given = MATERIALX
    for column, (name, (shader, inputs, _)) in enumerate(given.items()):
        sphere = place(UsdGeom.Sphere.Define(made, f"/World/ball_{name}"), 2.2 * column, 0, 0)
        bind(sphere, material(made, name, shader, **inputs))
    loaded = load(saved(made), SKY)
    for node in loaded.nodes():
        if node.mesh is not None:
            (section,) = node.mesh.sections
            own = pica.Material(**{"metallic": 0.0} | given[section.material.name][2])
            mesh = pica.Mesh.from_arrays(section.positions, section.indices, normals=section.normals, material=own)
            copy = expected.add(pica.Node("copy", mesh=mesh))
            copy.transform = node.world
    camera = pica.Camera.look_at((3.3, 1.5, 8), (3.3, 0, 0), vertical_fov=math.radians(18))
    want = picture(expected, device, camera)
    assert want.std() > 0.1
    assert flip(want, picture(loaded, device, camera))[0] <= MOST


def test_textures_look_as_those_of_pica(device: Device, tmp_path: Path) -> None:
    """Base colour from a picture, its alpha as a mask; roughness and metallic from red of two pictures."""
    import PIL.Image

    checks = (np.indices((4, 4)).sum(0) % 2 * 255).astype(np.uint8)
    rgba = np.stack([checks, 255 - checks, np.full((4, 4), 40, np.uint8), np.full((4, 4), 255, np.uint8)], axis=-1)
    rgba[0, :, 3] = 0  # the top row is not there
    PIL.Image.fromarray(rgba).save(tmp_path / "base.png")
    (tmp_path / "rough.png").write_bytes(png((100, 7, 9)))
    PIL.Image.fromarray(255 - checks).save(tmp_path / "metal.png")
    made = stage(tmp_path / "a.usda")
    painted = material(made, "painted", opacityThreshold=0.5)
    bind(quad(made), painted)
    for key, file, output in (
        ("diffuseColor", "base.png", "rgb"), ("roughness", "rough.png", "r"), ("metallic", "metal.png", "r"),
    ):  # fmt: skip
        texture(made, painted, key, file, output, wrapS="clamp", wrapT="clamp")
    sampler = made.GetPrimAtPath("/World/painted/texture_diffuseColor")
    from pxr import Sdf, UsdShade

    surface = UsdShade.Shader(made.GetPrimAtPath("/World/painted/surface"))
    opacity = surface.CreateInput("opacity", Sdf.ValueTypeNames.Float)
    opacity.ConnectToSource(UsdShade.Shader(sampler).ConnectableAPI(), "a")
    loaded = load(saved(made), SKY)
    clamp = pica.Sampler(wrap_u=pica.Wrap.CLAMP_TO_EDGE, wrap_v=pica.Wrap.CLAMP_TO_EDGE)
    packed = np.stack([checks, np.full((4, 4), 100, np.uint8), 255 - checks], axis=-1)
    own = pica.Material(
        base_color_texture=pica.Texture.from_array(rgba, encoding="srgb", sampler=clamp),
        metallic_roughness_texture=pica.Texture.from_array(packed, encoding="linear", sampler=clamp),
        alpha_mode=pica.AlphaMode.MASK,
    )
    corners, uv = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1), (1, 1), (1, 0), (0, 0)]
    expected = pica.Scene("expected", environment=SKY)
    expected.add(pica.Node("quad", mesh=pica.Mesh.from_arrays(corners, [(0, 1, 2), (0, 2, 3)], uv=uv, material=own)))
    camera = pica.Camera.look_at((0.5, 0.5, 4), (0, 0, 0), vertical_fov=math.radians(32))
    want = picture(expected, device, camera)
    assert want.std() > 0.05
    assert flip(want, picture(loaded, device, camera))[0] <= MOST


def usd_light(made, kind: str):
    light = getattr(UsdLux, kind).Define(made, "/World/light")
    UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(0, 200, 0))
    UsdGeom.Xformable(light).AddRotateXOp().Set(-90.0)  # -Z down
    light.CreateColorAttr((1.0, 0.8, 0.6))
    light.CreateExposureAttr(1.0)
    return light


def lights(made, kind: str) -> pica.Light:
    """Define a light in a stage of centimetres; the one of pica that is the same."""
    color = (1.0, 0.8, 0.6)
    if kind == "distant":
        light = usd_light(made, "DistantLight")
        light.CreateIntensityAttr(1000.0)
        light.CreateAngleAttr(4.0)
        illuminance = 2000 * math.pi * math.sin(math.radians(2)) ** 2
        return pica.DirectionalLight(color, illuminance, math.radians(4))
    if kind == "rectangle":
        light = usd_light(made, "RectLight")
        light.CreateIntensityAttr(10.0)
        light.CreateWidthAttr(80.0)
        light.CreateHeightAttr(40.0)
        return pica.RectangleLight(color, 20.0, 0.8, 0.4)
    if kind == "disk":
        light = usd_light(made, "DiskLight")
        light.CreateIntensityAttr(math.pi * 900 * 10)
        light.CreateRadiusAttr(30.0)
        light.CreateNormalizeAttr(True)
        return pica.DiskLight(color, 20.0, 0.3)
    if kind == "sphere":
        light = usd_light(made, "SphereLight")
        light.CreateIntensityAttr(20.0)
        light.CreateRadiusAttr(20.0)
        return pica.SphereLight(color, 40.0, 0.2)
    if kind == "tube":
        light = usd_light(made, "CylinderLight")
        light.CreateIntensityAttr(20.0)
        light.CreateRadiusAttr(10.0)
        light.CreateLengthAttr(100.0)
        return pica.TubeLight(color, 40.0, 1.0, 0.1)
    light = usd_light(made, "SphereLight")
    light.CreateIntensityAttr(100.0)
    light.CreateRadiusAttr(10.0)
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingConeAngleAttr(30.0)
    shaping.CreateShapingConeSoftnessAttr(0.5)
    return pica.SpotLight(color, 200 * math.pi * 0.01, math.radians(15), math.radians(30), 0.1)


@pytest.mark.parametrize("kind", ["distant", "rectangle", "disk", "sphere", "tube", "spot"])
def test_lights_are_those_of_pica(kind: str, device: Device, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda", unit=0.01)
    light = lights(made, kind)
    ground = quad(made, "/World/ground", size=300)
    UsdGeom.Xformable(ground).AddRotateXOp().Set(-90.0)
    place(UsdGeom.Cube.Define(made, "/World/box"), 0, 30, 0).CreateSizeAttr(60.0)
    loaded = load(saved(made), pica.Environment(np.full((2, 4, 3), 0.01)))
    (node,) = [node for node in loaded.nodes() if node.light]
    read = node.light
    camera = pica.Camera.look_at((2, 3, 5), (0, 0.3, 0), vertical_fov=math.radians(30))
    got = picture(loaded, device, camera)
    same = loaded.add(pica.Node("same", light=light))
    same.transform = np.array([[1.0, 0, 0, 0], [0, 0, 1, 2], [0, -1, 0, 0], [0, 0, 0, 1]])
    node.light = None
    want = picture(loaded, device, camera)
    assert want.std() > 0.05 and type(read) is type(light)
    assert flip(want, got)[0] <= MOST


def test_a_dome_is_the_environment(tmp_path: Path) -> None:
    from pica.images.pictures import write_exr

    sky = np.zeros((8, 16, 3), np.float32)
    sky[:, 8:10] = (1, 2, 4)  # just right of the middle, which is +Z in OpenEXR, and so at -X from there
    write_exr(tmp_path / "sky.exr", dict(zip("RGB", np.moveaxis(sky, -1, 0), strict=True)))
    seen = {}
    for name, up in (("plain", "Y"), ("turned", "Y"), ("z", "Z")):
        made = stage(tmp_path / f"{name}.usda", up=up)
        quad(made)
        dome = UsdLux.DomeLight.Define(made, "/World/dome")
        dome.CreateTextureFileAttr("sky.exr")
        dome.CreateIntensityAttr(3.0)
        if name == "turned":
            UsdGeom.Xformable(dome).AddRotateYOp().Set(90.0)
        if name == "z":
            UsdGeom.Xformable(dome).AddRotateXOp().Set(90.0)
        environment = load(saved(made), None).environment
        height, width, _ = environment.radiance.shape
        brightest = np.argmax(environment.radiance[height // 2].sum(axis=1)) + 0.5
        angle = (brightest / width - 0.5) * 2 * math.pi  # atan2(z, x) before the rotation
        x, z = math.cos(angle), math.sin(angle)
        c, s = math.cos(environment.rotation), math.sin(environment.rotation)
        seen[name] = (c * x + s * z, -s * x + c * z)
        assert environment.radiance.max() == pytest.approx(12, rel=0.01)
    assert seen["plain"][1] > 0.9 and seen["plain"][0] < 0
    assert seen["turned"][0] > 0.9 and seen["turned"][1] > 0
    assert seen["z"] == pytest.approx(seen["plain"], abs=1e-3)
