"""Small files that hold everything pica reads, to be broken."""

import io
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import PIL.Image

from pica.images import pictures
from tests.images import block_pictures, ktx2_cube_maps, ktx2_pictures
from tests.scene.compressed_files import draco_file, grid, meshopt_view
from tests.scene.gltf_files import TRIANGLE, GltfFile


def picture(kind: str) -> bytes:
    """A small picture as PNG, JPEG, WEBP, AVIF, DDS, or one of KTX 2."""
    if kind == "plain":
        return ktx2_pictures.plain(ktx2_pictures.RAMP, ktx2_pictures.RGBA8, zstd=True)
    if kind in ("etc1s", "etc1s_alpha", "uastc", "uastc_zstandard"):
        return ktx2_pictures.basis(kind)
    if kind in ("blocks", "zstandard_blocks"):
        levels = block_pictures.levels_of(block_pictures.float_block((1, 2, 3)), 8, 4)
        return block_pictures.ktx2_of("BC6H", 8, levels, kind == "zstandard_blocks")
    if kind == "dds_blocks":
        return block_pictures.dds_of("BC7", 8, block_pictures.levels_of(block_pictures.float_block((1, 2, 3)), 8, 4))
    pixels = np.random.default_rng(1).integers(0, 255, (8, 8, 4 if kind != "JPEG" else 3), np.uint8)
    content = io.BytesIO()
    PIL.Image.fromarray(pixels).save(content, kind)
    return content.getvalue()


@cache
def exr() -> bytes:
    """8x4 pixels of radiance."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sky.exr"
        ramp = np.linspace(0, 4, 32, dtype=np.float32).reshape(4, 8)
        pictures.write_exr(path, {"R": ramp, "G": ramp, "B": ramp})
        return path.read_bytes()


def hdr() -> bytes:
    """8x4 pixels of radiance, not compressed."""
    pixels = np.random.default_rng(2).integers(0, 140, (4, 8, 4), np.uint8)
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + pixels.tobytes()


def cube_map() -> bytes:
    """Six faces of 4x4 pixels of radiance, with Zstandard."""
    return ktx2_cube_maps.cube_map(np.ones(288, "<f2").tobytes(), 4, ktx2_cube_maps.HALF, zstd=True)


def look_up_table() -> bytes:
    """The identity, with every keyword."""
    rows = [f"{r} {g} {b}" for b in (0, 0.5, 1) for g in (0, 0.5, 1) for r in (0, 0.5, 1)]
    return "\n".join(['TITLE "a"', "LUT_3D_SIZE 3", "DOMAIN_MIN 0 0 0", "DOMAIN_MAX 1 1 1", *rows]).encode()


@cache
def gltf() -> GltfFile:
    """Meshes with every attribute, sparse accessors, textures, a skin, morph targets, animations, lights, cameras,
    instances, and all extensions that are read."""
    file = GltfFile()
    for kind in ("PNG", "JPEG"):
        view = file.view(picture(kind))
        file.add("images", bufferView=view, mimeType=f"image/{kind.lower()}")
    file.add("samplers", magFilter=9729, minFilter=9987, wrapS=10497, wrapT=33071)
    file.add("textures", source=0, sampler=0)
    file.add("textures", source=1)
    moved = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 2], "texCoord": 0}}
    file.add(
        "materials",
        name="all",
        pbrMetallicRoughness={
            "baseColorFactor": [0.5, 0.6, 0.7, 0.8],
            "baseColorTexture": {"index": 0, "texCoord": 0, "extensions": moved},
            "metallicFactor": 0.2,
            "roughnessFactor": 0.4,
            "metallicRoughnessTexture": {"index": 1},
        },
        normalTexture={"index": 1, "scale": 0.5},
        occlusionTexture={"index": 1, "strength": 0.5},
        emissiveTexture={"index": 0},
        emissiveFactor=[1, 0.5, 0.2],
        alphaMode="MASK",
        alphaCutoff=0.4,
        doubleSided=True,
        extensions={
            "KHR_materials_emissive_strength": {"emissiveStrength": 3},
            "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_specular": {"specularFactor": 0.7, "specularColorFactor": [1, 0.9, 0.8]},
            "KHR_materials_transmission": {"transmissionFactor": 0.2},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatNormalTexture": {"index": 1, "scale": 0.5}},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyTexture": {"index": 1}},
            "KHR_materials_iridescence": {"iridescenceFactor": 0.5, "iridescenceThicknessTexture": {"index": 1}},
            "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.4, 0.3], "sheenColorTexture": {"index": 1}},
        },
        extras={"pica": {"simplified": None}, "else": [1]},
    )
    glossy = {"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}, "glossinessFactor": 0.5}
    extensions = {"KHR_materials_unlit": {}, "KHR_materials_pbrSpecularGlossiness": glossy}
    file.add("materials", name="flat", alphaMode="BLEND", extensions=extensions)
    corner = np.array(TRIANGLE, np.float32)
    attributes = {
        "NORMAL": file.accessor(np.tile((0, 0, 1), (3, 1))),
        "TANGENT": file.accessor(np.tile((1, 0, 0, 1), (3, 1))),
        "TEXCOORD_0": file.accessor(corner[:, :2]),
        "COLOR_0": file.accessor(np.full((3, 4), 200), "u1", normalized=True),
        "JOINTS_0": file.accessor(np.zeros((3, 4)), "u2"),
        "WEIGHTS_0": file.accessor(np.tile((1, 0, 0, 0), (3, 1))),
    }
    sparse = {
        "count": 1,
        "indices": {"bufferView": file.view(b"\1\0"), "componentType": 5123},
        "values": {"bufferView": file.view(np.float32([2, 0, 0]).tobytes())},
    }
    moved_positions = file.accessor(corner, sparse=sparse)
    skinned = file.mesh(
        moved_positions,
        attributes=attributes,
        indices=file.accessor(np.arange(3), "u2"),
        material=0,
        mode=4,
        targets=[{"POSITION": file.accessor(corner * 0.1), "NORMAL": file.accessor(corner * 0)}],
        extensions={"KHR_materials_variants": {"mappings": [{"variants": [0], "material": 1}]}},
        node={"name": "skinned", "skin": 0, "weights": [0.5]},
    )
    dots = file.mesh(mode=0, attributes={"COLOR_0": file.accessor(np.ones((3, 3)))})
    file.json["meshes"][-1]["primitives"] += [file.json["meshes"][-1]["primitives"][0] | {"mode": 2}]
    joint = file.add("nodes", name="joint", translation=[0, 1, 0], rotation=[0, 0, 0, 1], scale=[1, 1, 1])
    file.add("skins", joints=[joint], skeleton=joint, inverseBindMatrices=None)
    del file.json["skins"][0]["inverseBindMatrices"]
    instances = {
        "TRANSLATION": file.accessor(corner),
        "ROTATION": file.accessor(np.tile((0, 0, 0, 1), (3, 1))),
        "SCALE": file.accessor(np.ones((3, 3))),
    }
    many = file.mesh(material=1, node={"extensions": {"EXT_mesh_gpu_instancing": {"attributes": instances}}})
    lights = [
        {"type": "directional", "color": [1, 0.9, 0.8], "intensity": 3, "name": "sun"},
        {"type": "point", "range": 10, "intensity": 100},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
    ]
    variants = {"variants": [{"name": "other"}]}
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}, "KHR_materials_variants": variants}
    file.json["extensions"]["KHR_xmp_json_ld"] = {"packets": [{"dc:title": "all", "dc:creator": {"@list": ["one"]}}]}
    file.json["asset"] |= {"copyright": "one", "extensions": {"KHR_xmp_json_ld": {"packet": 0}}}
    shining = [file.add("nodes", extensions={"KHR_lights_punctual": {"light": i}}) for i in range(3)]
    file.json["nodes"][shining[0]]["extensions"]["KHR_node_visibility"] = {"visible": False}
    file.add("cameras", type="perspective", perspective={"yfov": 0.8, "znear": 0.1, "zfar": 100, "aspectRatio": 1.5})
    file.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 2, "znear": 0.1, "zfar": 100})
    seeing = [file.add("nodes", camera=i, translation=[0, 0, 5]) for i in range(2)]
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]
    root = file.add(
        "nodes", matrix=matrix, children=[skinned, many, dots, joint, *shining, *seeing], extras={"pica": {}}
    )
    file.add("scenes", nodes=[root], name="all")
    times = file.accessor([0.0, 0.5, 1.0], min=[0], max=[1])
    outputs = {
        "translation": file.accessor(corner),
        "rotation": file.accessor(np.tile((0, 0, 0, 1), (3, 1))),
        "scale": file.accessor(np.ones((9, 3))),
        "weights": file.accessor([0.0, 1.0, 0.5]),
    }
    samplers = [
        {"input": times, "output": output, "interpolation": "CUBICSPLINE" if path == "scale" else "LINEAR"}
        for path, output in outputs.items()
    ]
    targets = [{"node": skinned if path == "weights" else joint, "path": path} for path in outputs]
    channels = [{"sampler": i, "target": target} for i, target in enumerate(targets)]
    pointers = {
        "/materials/0/pbrMetallicRoughness/baseColorFactor": [[1.0, 1, 1, 1]] * 3,
        "/materials/0/emissiveFactor": corner,
        "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor": [0.0, 1.0, 0.5],
        "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/rotation": [0.0, 1, 2],
        "/extensions/KHR_lights_punctual/lights/2/spot/outerConeAngle": [0.3, 0.4, 0.5],
        "/cameras/0/perspective/yfov": [0.5, 0.6, 0.7],
        f"/nodes/{skinned}/extensions/KHR_node_visibility/visible": [1.0, 0.0, 1.0],
    }
    for pointer, values in pointers.items():
        target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
        channels.append({"sampler": len(samplers), "target": target})
        samplers.append({"input": times, "output": file.accessor(values), "interpolation": "LINEAR"})
    file.add("animations", name="all", samplers=samplers, channels=channels)
    used = ["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_texture_transform", "KHR_materials_unlit"]
    file.json |= {"scene": 0, "extensionsUsed": used}
    return file


@cache
def compressed() -> GltfFile:
    """A mesh of Draco, one of meshopt's three modes, and textures of KTX 2, AVIF and DDS."""
    attributes, triangles = grid(5)
    file = draco_file(attributes, triangles)
    names = {"etc1s": "KHR_texture_basisu", "uastc": "KHR_texture_basisu"}
    names |= {"AVIF": "EXT_texture_avif", "DDS": "MSFT_texture_dds"}
    for kind, name in names.items():
        image = file.add("images", bufferView=file.view(picture(kind)))
        texture = file.add("textures", extensions={name: {"source": image}})
        file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    file.json["meshes"][0]["primitives"][0]["material"] = 0
    for number, (mode, prefix) in enumerate((("TRIANGLES", "EXT"), ("INDICES", "KHR"))):
        view = meshopt_view(file, attributes["POSITION"], "ATTRIBUTES", version=number, prefix=prefix)
        positions = file.add("accessors", type="VEC3", componentType=5126, count=25, bufferView=view)
        view = meshopt_view(file, triangles.reshape(-1), mode, prefix=prefix)
        order = file.add("accessors", type="SCALAR", componentType=5125, count=triangles.size, bufferView=view)
        file.mesh(positions, indices=order, material=1 + number)
    return file


@cache
def other_formats() -> dict[str, bytes]:
    """A small file of each format that is converted, by suffix; those of USD if its library is installed."""
    from tests.scene import mesh_files

    shape = mesh_files.cube()
    files = {
        ".obj": mesh_files.obj(shape, "mtllib a.mtl", "o one\nusemtl m\ns 1").encode(),
        ".ply": mesh_files.ply(shape, colors=True),
        ".stl": mesh_files.stl(shape),
        ".3mf": mesh_files.threemf(shape),
        ".dae": mesh_files.collada(shape),
    }
    if find_spec("pxr") is None:
        return files
    with TemporaryDirectory() as folder:
        from pxr import UsdUtils

        for suffix in (".usda", ".usdc"):
            files[suffix] = usd(Path(folder) / f"whole{suffix}").read_bytes()
        (Path(folder) / "a.png").write_bytes(picture("PNG"))
        UsdUtils.CreateNewUsdzPackage(str(Path(folder) / "whole.usda"), str(Path(folder) / "whole.usdz"))
        files[".usdz"] = (Path(folder) / "whole.usdz").read_bytes()
    return files


def usd(path: Path) -> Path:
    """A stage with meshes, subdivision, subsets, instances, a texture, lights, a camera and a motion."""
    from pxr import Gf, UsdGeom, UsdLux, UsdShade

    from tests.scene import usd_files

    made = usd_files.stage(path, up="Z", unit=0.1)
    painted = usd_files.bind(usd_files.quad(made), usd_files.material(made, "painted", metallic=0.5))
    usd_files.texture(made, UsdShade.Material(made.GetPrimAtPath("/World/painted")), "diffuseColor", "a.png")
    UsdShade.MaterialBindingAPI(painted).CreateMaterialBindSubset("some", [0], "face")
    cube = usd_files.cube(made, scheme="catmullClark")
    cube.CreateCreaseIndicesAttr([0, 1, 3])
    cube.CreateCreaseLengthsAttr([3])
    cube.CreateCreaseSharpnessesAttr([2.0])
    move = UsdGeom.Xformable(cube).AddTransformOp()
    for code in (1, 4):
        move.Set(Gf.Matrix4d(Gf.Rotation(Gf.Vec3d(0, 0, 1), 30 * code), Gf.Vec3d(code, 0, 0)), code)
    instancer = UsdGeom.PointInstancer.Define(made, "/World/many")
    instancer.CreatePrototypesRel().AddTarget(UsdGeom.Capsule.Define(made, "/World/many/one").GetPath())
    instancer.CreateProtoIndicesAttr([0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (1, 0, 0)])
    UsdLux.RectLight.Define(made, "/World/light").CreateColorTemperatureAttr(4000.0)
    UsdLux.DomeLight.Define(made, "/World/dome")
    UsdGeom.Camera.Define(made, "/World/camera").CreateFStopAttr(2.0)
    return usd_files.saved(made)
