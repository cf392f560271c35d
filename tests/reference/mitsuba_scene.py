"""A pica scene as a Mitsuba 3 scene with the same light transport, to check pica's path tracer against.

Not carried over: unlit materials, orthographic cameras, and that cameras do not see the back of single-sided
surfaces.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Scene, Section
from tests.reference.mitsuba_light import PicaLight
from tests.reference.mitsuba_material import DiffuseTransmitter, PicaSurface, TextureReader, linear_pixels
from tests.reference.variant import mi

mi.register_bsdf("pica_surface", PicaSurface)
mi.register_emitter("pica_light", PicaLight)


def render_reference(
    scene: Scene, camera: Camera, size: tuple[int, int], samples: int, max_depth: int | None = None, seed: int = 0
) -> NDArray[np.float32]:
    """(height, width, 3) radiance in nits through a box filter; `size` is (width, height).

    `max_depth` counts path edges as pica's path tracer does: 1 is what shines itself, 2 adds direct light.
    """
    converted = mitsuba_scene(scene)
    # The volumetric integrator sees through masks on shadow rays and does not count them as path edges.
    masked = any(not material.stops_rays() for material in _materials(scene))
    integrator = mi.load_dict(
        {"type": "volpath" if masked else "path", "max_depth": -1 if max_depth is None else max_depth}
    )
    sensor = mi.load_dict(_sensor(camera, size))
    width, height = size
    per_pass = max(1, min(samples, 2**24 // (width * height)))
    total, done = np.zeros((height, width, 3)), 0
    while done < samples:
        count = min(per_pass, samples - done)
        image = mi.render(converted, sensor=sensor, integrator=integrator, spp=count, seed=seed * 65536 + done)
        total += np.array(image, np.float64)[..., :3] * count
        done += count
    return (total / samples).astype(np.float32)


def mitsuba_scene(scene: Scene) -> mi.Scene:
    """All of a pica scene but its cameras."""
    low, high = scene.bounds()
    far = float(np.linalg.norm(high - low))
    textures = TextureReader()
    surfaces: dict[int, PicaSurface | mi.BSDF] = {}
    entries: dict[str, object] = {"type": "scene"}
    for node in scene.nodes():
        if node.mesh is not None:
            for section in node.mesh.sections:
                surface = surfaces.setdefault(id(section.material), _surface(section.material, textures))
                for world in node.instance_transforms():
                    for shape in _shapes(section, world, surface, 1e-6 * far):
                        entries[f"shape{len(entries)}"] = shape
        if node.light is not None:
            entries[f"light{len(entries)}"] = mi.load_dict({"type": "pica_light"}).use(node.light, node.world, far)
    if scene.environment is not None:
        entries["environment"] = _environment(scene.environment)
    return mi.load_dict(entries)


def _materials(scene: Scene) -> list[Material]:
    return [section.material for node in scene.nodes() if node.mesh for section in node.mesh.sections]


def _surface(material: Material, textures: TextureReader) -> mi.BSDF:
    assert not material.unlit, f"{material.name}: unlit materials have no counterpart here"
    if material.diffuse_transmission > 0:
        return DiffuseTransmitter(mi.Properties()).use(material)
    if material.transmission > 0:
        return _glass(material)
    plain = material.base_color_texture is None and material.normal_texture is None
    if material.specular == 0 and material.metallic == 0 and plain and material.alpha_mode is AlphaMode.OPAQUE:
        color = {"type": "rgb", "value": list(material.base_color[:3])}
        return mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}})
    surface = mi.load_dict({"type": "pica_surface"})
    return surface.use(material, textures)


def _glass(material: Material) -> mi.BSDF:
    """Mitsuba's own dielectrics, for what is fully transmissive, and clear but for absorption inside."""
    assert (material.transmission, material.base_color[:3]) == (1.0, (1.0, 1.0, 1.0))
    if material.ior == 1:
        assert material.specular == 0
        return mi.load_dict({"type": "null"})
    assert material.specular == 1
    if material.thin_walled:
        assert material.roughness == 0
        return mi.load_dict({"type": "thindielectric", "int_ior": material.ior, "ext_ior": 1.0})
    kind = {"type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0}
    if material.roughness > 0:
        kind |= {"type": "roughdielectric", "distribution": "ggx", "alpha": material.roughness**2}
    return mi.load_dict(kind)


def _medium(material: Material) -> mi.Medium:
    scattering = np.array(material.scattering)
    extinction = scattering + material.absorption
    most = float(extinction.max())
    return mi.load_dict(
        {
            "type": "homogeneous",
            "albedo": {"type": "rgb", "value": (scattering / np.maximum(extinction, 1e-9)).tolist()},
            "sigma_t": {"type": "rgb", "value": (extinction / most).tolist()},
            "scale": most,
            "phase": {"type": "hg", "g": material.scatter_anisotropy},
        }
    )


def _shapes(section: Section, world: NDArray[np.float64], surface: mi.BSDF, gap: float) -> list[mi.Mesh]:
    """The section in the world; a double-sided one that shines becomes two, `gap` metres off the surface."""
    material = section.material
    if not any(material.emission):
        return [_shape(section, world, surface)]
    radiance: dict[str, object] = {"type": "rgb", "value": list(material.emission)}
    if material.emissive_texture is not None:
        assert material.emissive_texture.uv_set == 0
        pixels = linear_pixels(material.emissive_texture, srgb=True)[..., :3] * np.float32(material.emission)
        a, b, c, d, e, f = material.emissive_texture.transform
        to_uv = mi.ScalarTransform3f([[a, b, c], [d, e, f], [0, 0, 1]])
        radiance = {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": True, "to_uv": to_uv}
    emitter = {"type": "area", "radiance": radiance}
    if not material.double_sided:
        return [_shape(section, world, surface, emitter)]
    return [_shape(section, world, surface, emitter, side * gap) for side in (1, -1)]


def _shape(
    section: Section,
    world: NDArray[np.float64],
    surface: mi.BSDF,
    emitter: dict[str, object] | None = None,
    offset: float = 0.0,
) -> mi.Mesh:
    linear = world[:3, :3]
    mirrored = np.linalg.det(linear) < 0
    normals = section.normals @ np.linalg.inv(linear)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    positions = section.positions @ linear.T + world[:3, 3] + normals * offset
    faces = section.indices[:, ::-1] if mirrored != (offset < 0) else section.indices
    normals = -normals if offset < 0 else normals
    props = mi.Properties()
    props["bsdf"] = surface
    if any((*section.material.absorption, *section.material.scattering)):
        props["interior"] = _medium(section.material)
    if emitter is not None:
        props["emitter"] = mi.load_dict(emitter)
    shape = mi.Mesh(
        "section", len(positions), len(faces), has_vertex_normals=True, has_vertex_texcoords=True, props=props
    )
    tangents = section.tangents[:, :3] @ linear.T
    signs = section.tangents[:, 3] * (-1 if mirrored else 1)
    uv1 = np.pad(section.uv1, ((0, 0), (0, 1)))
    for name, values in (
        ("tangent", tangents),
        ("tangent_sign", signs),
        ("uv1", uv1),
        ("tint", section.colors[:, :3]),
        ("alpha", section.colors[:, 3]),
    ):
        size = values.shape[1] if values.ndim > 1 else 1
        shape.add_attribute(f"vertex_{name}", size, mi.Float(np.ascontiguousarray(values, np.float32).ravel()))
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = mi.Float(positions.astype(np.float32).ravel())
    parameters["vertex_normals"] = mi.Float(normals.astype(np.float32).ravel())
    parameters["vertex_texcoords"] = mi.Float(section.uv0.ravel())
    parameters["faces"] = mi.UInt32(np.ascontiguousarray(faces).ravel())
    parameters.update()
    return shape


def _environment(environment: Environment) -> dict[str, object]:
    # Mitsuba's centre column looks towards +Z with +X to the left of it; a quarter turn makes it +X and +Z.
    turn = mi.ScalarTransform4f().rotate([0, 1, 0], 90 + math.degrees(environment.rotation))
    pixels = environment.radiance.copy()  # Bitmap refuses read-only arrays
    return {"type": "envmap", "bitmap": mi.Bitmap(pixels), "scale": environment.strength, "to_world": turn}


def _sensor(camera: Camera, size: tuple[int, int]) -> dict[str, object]:
    assert camera.orthographic_height is None
    # Mitsuba's cameras look along +Z with +X to the left.
    placed = camera.transform @ np.diag([-1.0, 1.0, -1.0, 1.0])
    film = {
        "type": "hdrfilm",
        "width": size[0],
        "height": size[1],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    return {
        "type": "perspective",
        "fov_axis": "y",
        "fov": math.degrees(camera.vertical_fov),
        "near_clip": camera.near,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f(placed),
        "film": film,
        "sampler": {"type": "independent"},
    }
