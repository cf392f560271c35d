"""Materials and textures on the GPU."""

import numpy as np
import pytest

from pica.gpu_scene.material_textures import MaterialTextures
from pica.gpu_scene.materials import MATERIAL, MaterialTable
from pica.images import pictures
from pica.images.blocks import BlockPicture
from pica.scene.camera import Camera
from pica.scene.changes import ChangeSet
from pica.scene.illumination import average_emission
from pica.scene.material import Image, Material, Sampler, Texture, Wrap
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import rotate
from tests.building import checkered, lambert, orthographic, placed, render, scene_of
from tests.images import block_pictures, ktx2_pictures
from tests.tracing.kernels import read

FRONT = orthographic((0, 0, 2), (0, 0, 0), 2.0)


def packed(device, *materials):
    table = MaterialTable(device, ChangeSet())
    for material in materials:
        table.acquire(material)
    with device.record() as recording:
        table.table.flush(recording)
    return table, read(table.table.buffer, MATERIAL)[: len(materials)]


@pytest.fixture
def created(device, monkeypatch):
    """The sizes of the textures that are created."""
    sizes = []
    handle = device.handle

    class Counting:
        def __getattr__(self, name):
            return getattr(handle, name)

        def create_texture(self, **description):
            sizes.append((description["width"], description["height"]))
            return handle.create_texture(**description)

    monkeypatch.setattr(device, "handle", Counting())
    return sizes


def test_an_image_used_twice_is_uploaded_once(device, created):
    image, other = checkered(), checkered()
    one = Material(base_color_texture=Texture(image), emissive_texture=Texture(image, uv_set=1))
    two = Material(base_color_texture=Texture(image, Sampler(linear=False)))
    three = Material(base_color_texture=Texture(other))
    table, rows = packed(device, one, two, three)
    assert len(created) == 2
    handles = rows["base_color_texture"]["texture"]
    assert handles[0] == handles[1] == rows["emissive_texture"]["texture"][0] != handles[2]
    samplers = rows["base_color_texture"]["sampler"]
    assert samplers[0] == samplers[2] != samplers[1]
    assert table is not None


def test_an_image_as_colour_and_as_data_is_two_textures(device, created):
    image = checkered()
    _, rows = packed(device, Material(base_color_texture=Texture(image), normal_texture=Texture(image)))
    assert len(created) == 2
    assert rows["base_color_texture"]["texture"][0] != rows["normal_texture"]["texture"][0]


def test_what_is_absent_is_marked(device):
    _, rows = packed(device, Material(), Material(occlusion_texture=Texture(checkered(cells=2))))
    for name in MATERIAL.names:
        if name.endswith("_texture"):
            assert rows[name]["texels"][0] == 0
    assert rows["occlusion_texture"]["texels"][1] == 16 * 16


def picture_of(device, material, size=(64, 64), uv_scale=1.0, frames=1):
    """The base colour of a wall of 2 x 2 metres that fills the picture."""
    wall = plane(2, 2, material)
    wall.uv0 = wall.uv0 * uv_scale
    wall.uv1 = wall.uv0[:, ::-1].copy()
    return render(device, scene_of(placed(wall, rotate("x", 90))), frames, FRONT, size).aov("albedo")


def ramp():
    """32 x 32: red grows to the right, green grows down, both in steps of a texel."""
    pixels = np.full((32, 32, 4), 255, np.uint8)
    pixels[..., 0] = np.arange(32) * 8
    pixels[..., 1] = np.arange(32)[:, None] * 8
    return Image(pixels)


def linear(srgb):
    srgb = np.asarray(srgb) / 255
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def test_textures_lie_the_right_way_up_and_are_decoded(device):
    albedo = picture_of(device, lambert(1, base_color_texture=Texture(ramp(), Sampler(linear=False))))
    expected = linear(np.repeat(np.arange(32) * 8, 2))
    np.testing.assert_allclose(albedo[..., 0], np.tile(expected, (64, 1)), atol=2e-3)
    np.testing.assert_allclose(albedo[..., 1], np.tile(expected, (64, 1)).T, atol=2e-3)


def test_second_coordinates_and_factor(device):
    material = lambert(1, base_color_texture=Texture(ramp(), Sampler(linear=False), uv_set=1))
    material.base_color = (0.5, 1, 1, 1)
    albedo = picture_of(device, material)
    expected = linear(np.repeat(np.arange(32) * 8, 2))
    np.testing.assert_allclose(albedo[..., 0], 0.5 * np.tile(expected, (64, 1)).T, atol=2e-3)


def test_texture_transform(device):
    """u' = v, v' = 1 - u: a quarter turn."""
    turned = Texture(ramp(), Sampler(linear=False), transform=(0, 1, 0, -1, 0, 1))
    albedo = picture_of(device, lambert(1, base_color_texture=turned))
    expected = linear(np.repeat(np.arange(32) * 8, 2))
    np.testing.assert_allclose(albedo[..., 0], np.tile(expected, (64, 1)).T, atol=2e-3)
    np.testing.assert_allclose(albedo[..., 1], np.tile(expected[::-1], (64, 1)), atol=2e-3)


@pytest.mark.parametrize("wrap", Wrap)
def test_wrapping(device, wrap):
    texture = Texture(ramp(), Sampler(wrap, wrap, linear=False))
    row = picture_of(device, lambert(1, base_color_texture=texture), uv_scale=2.0)[32, :, 0]
    steps = np.arange(64)  # of texels
    texel = {
        Wrap.REPEAT: steps % 32,
        Wrap.MIRRORED_REPEAT: np.where(steps < 32, steps, 63 - steps),
        Wrap.CLAMP_TO_EDGE: np.minimum(steps, 31),
    }[wrap]
    np.testing.assert_allclose(row, linear(texel * 8), atol=2e-3)


def test_small_texels_are_averaged(device):
    """A fine board seen from afar is grey, without patterns: mip levels are made and chosen."""
    pixels = np.full((256, 256, 4), 255, np.uint8)
    pixels[..., :3] = (np.indices((256, 256)).sum(0) % 2 * 255)[..., None]
    albedo = picture_of(device, lambert(1, base_color_texture=Texture(Image(pixels))), uv_scale=4.0)
    np.testing.assert_allclose(albedo[8:-8, 8:-8], 0.5, atol=0.02)


def test_level_of_detail_follows_the_distance(device):
    """A texture whose mip levels have different colours: the level is the logarithm of texels per pixel."""
    noise = np.random.default_rng(0).integers(0, 2, (256, 256, 1)) * np.full(4, 255)
    noise[..., 3] = 255
    material = lambert(1, base_color_texture=Texture(Image(noise.astype(np.uint8))))
    wall = placed(plane(2, 2, material), rotate("x", 90))
    spread = []
    for distance in (1.0, 2.0, 4.0, 8.0, 16.0):
        camera = Camera.look_at((0, 0, distance), (0, 0, 0), vertical_fov=2 * np.arctan(0.5 / distance))
        size = round(128 / distance)  # pixels for one metre, 128 texels
        spread.append(render(device, scene_of(wall), 1, camera, (size, size)).aov("albedo")[..., 0].std())
    # Averages of 4 times as many texels spread half as much; one texel a pixel: 0.5, softened by the filter.
    assert spread[0] > 0.3
    ratios = np.array(spread[1:]) / spread[:-1]
    assert (ratios < 0.75).all() and (ratios > 0.3).all(), spread


def test_average_emission():
    pixels = np.zeros((32, 32, 4), np.uint8)
    pixels[:16] = 255
    dark, lamp = Material(), Material(emission=(2, 2, 2))
    assert average_emission(dark) == 0
    assert average_emission(lamp) == pytest.approx(2)
    assert average_emission(Material(emission=(2, 2, 2), emissive_texture=Texture(Image(pixels)))) == pytest.approx(1)
    assert average_emission(Material(emission=(0, 1, 0))) == pytest.approx(0.7152)
    assert average_emission(Material(emission=(0, 1, 0), unlit=True)) == 0, "its base colour is all that it shows"


@pytest.mark.parametrize(("encoding", "expected"), [("srgb", linear(128)), ("linear", 128 / 255)])
@pytest.mark.parametrize("slot", ["base_color", "emissive"])
def test_images_that_say_what_they_are_are_decoded_so(device, slot, encoding, expected):
    texture = Texture.from_array(np.full((4, 4), 128, np.uint8), encoding=encoding)
    material = lambert(1, emission=(1, 1, 1), **{f"{slot}_texture": texture})
    scene = scene_of(placed(plane(2, 2, material), rotate("x", 90)))
    frame = render(device, scene, 1, Camera.look_at((0, 0, 0.5), (0, 0, 0)), (8, 8))
    found = frame.aov("albedo") if slot == "base_color" else frame.color
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert average_emission(material) == pytest.approx(1 if slot == "base_color" else expected, abs=0.01)


def test_data_of_an_srgb_image_too(device):
    texture = Texture.from_array(np.full((4, 4), 128, np.uint8), encoding="srgb")
    material = lambert(1, metallic_roughness_texture=texture)
    scene = scene_of(placed(plane(2, 2, material), rotate("x", 90)))
    frame = render(device, scene, 1, Camera.look_at((0, 0, 0.5), (0, 0, 0)), (8, 8))
    np.testing.assert_allclose(frame.aov("roughness"), linear(128), atol=5e-3)


def compressed(name="uastc"):
    """The ramp of the tests of KTX 2, 32 x 32, as a file's texture is loaded."""
    return Image.of_blocks(pictures.open_texture(ktx2_pictures.basis(name), name)())


def test_compressed_textures_look_like_their_pixels(device):
    image = compressed()
    blocks = picture_of(device, lambert(1, base_color_texture=Texture(image)))
    image.pixels = image.pixels
    assert image.blocks is None
    pixels = picture_of(device, lambert(1, base_color_texture=Texture(image)))
    np.testing.assert_allclose(blocks, pixels, atol=3e-3)
    assert pixels.std() > 0.1


def test_compressed_textures_have_their_own_mipmaps(device):
    """Far away, the smallest level is all that is seen: here the file's, of another colour than its largest."""
    blocks = compressed().blocks
    last = pictures.open_texture(ktx2_pictures.basis("etc1s"), "etc1s")().levels[-1]
    mixed = Image.of_blocks(BlockPicture(32, 32, (*blocks.levels[:-1], last)))
    far = picture_of(device, lambert(1, base_color_texture=Texture(mixed)), size=(8, 8), uv_scale=100.0)
    expected = linear(BlockPicture(1, 1, (last,)).pixels()[0, 0, :3])
    np.testing.assert_allclose(far[4, 4], expected, atol=0.01)


def test_compressed_textures_take_a_byte_a_texel(device):
    image = compressed()
    textures = MaterialTextures(device)
    before = device.memory
    taken, kept = [], []
    for _ in range(2):
        kept.append(textures.of(image, srgb=False))
        assert textures.of(image, srgb=False) is kept[-1]
        taken.append(device.memory - before - sum(taken))
        image.pixels = image.pixels
    assert 32 * 32 < taken[0] < 1.6 * 32 * 32 < 4 * 32 * 32 < taken[1]
    kept.clear()
    assert device.memory == before


def test_compressed_textures_without_mipmaps_get_them_as_pixels(device):
    single = bytearray(ktx2_pictures.basis("uastc"))
    single[40] = 1  # the number of levels
    image = Image(pictures.open_texture(single, "single")())
    on_device = MaterialTextures(device).of(image, srgb=False)
    assert on_device.texture.mip_count == 6
    mean = np.asarray(on_device.texture.to_numpy(mip=5)).reshape(4) / 255
    np.testing.assert_allclose(mean, image.pixels.mean((0, 1)) / 255, atol=0.02)


TWO_SURFACES, TWO_COLORS = ((0, 60, 255), (0, 240, 0)), ((230, 230, 230), (20, 20, 20))
"""Texels of a bright metal beside a dark dielectric: of metallic_roughness_texture and base_color_texture."""


def two_columns(left, right) -> Image:
    """Two by two texels."""
    pixels = np.full((2, 2, 4), 255, np.uint8)
    pixels[:, 0, :3], pixels[:, 1, :3] = left, right
    return Image(pixels, "two columns", encoding="linear")


def far_surface(device, material: Material) -> tuple[float, float]:
    """Metalness and roughness of a wall whose textures are all within a pixel."""
    wall = placed(plane(2, 2, material), rotate("x", 90))
    section = wall.mesh.sections[0]
    section.uv0 = 100 * section.uv0
    frame = render(device, scene_of(wall), 1, FRONT, (8, 8))
    return frame.aov("metallic")[4, 4], frame.aov("roughness")[4, 4]


def test_coarse_levels_of_metalness_count_by_the_base_colour(device):
    """A plain mean makes half of a bright metal beside a dark dielectric diffuse."""
    surface, color = Texture(two_columns(*TWO_SURFACES)), Texture(two_columns(*TWO_COLORS))
    metallic, roughness = far_surface(device, Material(base_color_texture=color, metallic_roughness_texture=surface))
    assert metallic == pytest.approx(230 / 250, abs=0.01)
    metal, dielectric = 230 / 255, 0.04
    assert roughness == pytest.approx((60 * metal + 240 * dielectric) / (metal + dielectric) / 255, abs=0.01)


def test_textures_that_do_not_lie_on_the_base_colour_have_plain_means(device):
    surface, color = Texture(two_columns(*TWO_SURFACES)), two_columns(*TWO_COLORS)
    elsewhere = Texture(color, transform=(2, 0, 0, 0, 2, 0))
    for base_color in (None, elsewhere):
        found = far_surface(device, Material(base_color_texture=base_color, metallic_roughness_texture=surface))
        assert found == pytest.approx((0.5, 150 / 255), abs=0.01)


def test_roughness_in_srgb_has_plain_means(device):
    """No device writes to textures of that encoding."""
    surface, color = two_columns(*TWO_SURFACES), Texture(two_columns(*TWO_COLORS))
    surface.encoding = "srgb"
    metallic, _ = far_surface(device, Material(base_color_texture=color, metallic_roughness_texture=Texture(surface)))
    assert metallic == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("form", "dark"), [("BC6H", 0.0), ("BC6HS", -3.0)])
def test_floats_shine_by_their_values_and_reflect_at_most_all(device, form, dark):
    """Emission above 1 is in the picture, negative values are not; as a base colour they are 8-bit pixels."""
    block = block_pictures.float_block((4.0, 0.5, dark), signed=form == "BC6HS")
    levels = tuple(block_pictures.levels_of(block, 16, 5))
    image = Image.of_blocks(BlockPicture(16, 16, levels, form), encoding="linear")
    material = Material(base_color=(0, 0, 0, 1), emission=(1, 1, 1), emissive_texture=Texture(image))
    wall = placed(plane(2, 2, material), rotate("x", 90))
    shining = render(device, scene_of(wall), 1, FRONT, (8, 8)).aov("emission")
    np.testing.assert_allclose(shining[4, 4], (4, 0.5, 0), rtol=2e-2, atol=1e-3)
    lit = picture_of(device, lambert(1, base_color_texture=Texture(image)))
    np.testing.assert_allclose(lit[4, 4], (1, 0.5, 0), atol=0.01)
