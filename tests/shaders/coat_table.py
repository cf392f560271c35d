"""What coated surfaces lose, and what choosing lobes by their light is worth.

PYTHONPATH=. python tests/shaders/coat_table.py        prints the tables of docs/measurements/materials.md
"""

from pathlib import Path

import numpy as np
import slangpy as spy
from scipy.stats import qmc
from slangpy.core.calldata import SLANG_PATH

import pica
from tests.shaders.test_brdf import view_at
from tests.shaders.test_coats import SOURCE, furnace, stack

# With even chances for all lobes.
UNIFORM = """
import shaders.microfacets;
import shaders.sampling;
float uniformDensity(Layers layers, float3 view, float3 light)
{
    float density = mirrorPdf(view, light, alphaOf(layers.base.z)) + cosineHemispherePdf(light.z);
    Coats coats = surface(layers).coats;
    for (uint i = 0; i < layers.count; ++i)
        density += coats.mirrorDensity(i, view, light);
    return density / (layers.count + 2);
}
"""
ROUGHNESSES = (0.0, 0.3, 0.6, 1.0)
COSINES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.999)
LACQUER = ((1.0, 0.1, 1.5, 1.0),)
SURFACES = {
    "lacquer on red metal": stack((0.5, 1.0, 0.5, 0.04), LACQUER),
    "varnish on wood": stack((0.3, 0.0, 0.8, 0.02), LACQUER),
    "three coats on matter": stack((0.5, 0.0, 0.6, 0.0), ((1, 0.1, 1.5, 0), (1, 0.4, 1.9, 0), (1, 0.3, 1.3, 0))),
}


def loss(shader: spy.Module, metallic: float, base: float, coat: float) -> tuple[float, float]:
    """Of white under a coat of index 1.5: the smallest and the largest share of even light that comes back."""
    layers = stack((1.0, metallic, base, 0.04), ((1.0, coat, 1.5, 1.0),))
    shares = [float(furnace(shader, layers, cosine)[0]) for cosine in COSINES]
    return min(shares), max(shares)


def spreads(shader: spy.Module, layers: dict, cosine: float) -> tuple[float, float]:
    """Standard deviation of a sample over its mean, with chances by light and with even ones."""
    u, view = qmc.Sobol(3, seed=2).random(2**16).astype(np.float32), view_at(cosine)
    drawn = shader.direction(layers, view, u, _result="numpy")
    weight = shader.weight(layers, view, u, _result="numpy")[:, 0].astype(np.float64)
    light = np.ascontiguousarray(drawn[:, :3])
    uniform = shader.uniformDensity(layers, view, light, _result="numpy").astype(np.float64)
    mean = weight.mean()
    squares = (weight**2).mean(), np.where(weight > 0, weight**2 * drawn[:, 3] / np.maximum(uniform, 1e-20), 0).mean()
    by_light, even = (float(np.sqrt(max(square - mean**2, 0)) / mean) for square in squares)
    return by_light, even


def main() -> None:
    """Print the tables."""
    paths = [Path(pica.__file__).parent, SLANG_PATH]
    device = spy.Device(type=spy.DeviceType.vulkan, compiler_options={"include_paths": paths})
    shader = spy.Module(device.load_module_from_source("coat_table", SOURCE + UNIFORM))
    for metallic, what in ((1.0, "metal"), (0.0, "dielectric")):
        print(f"\n| white {what} \\ coat |", " | ".join(map(str, ROUGHNESSES)), "|")
        print("|---" * (len(ROUGHNESSES) + 1) + "|")
        for base in ROUGHNESSES:
            cells = [loss(shader, metallic, base, coat) for coat in ROUGHNESSES]
            print(f"| {base} |", " | ".join(f"{low:.3f} to {high:.3f}" for low, high in cells), "|")
    print("\n| surface | cosine | by light | even |\n|---|---|---|---|")
    for name, layers in SURFACES.items():
        for cosine in (0.9, 0.3):
            by_light, even = spreads(shader, layers, cosine)
            print(f"| {name} | {cosine} | {by_light:.2f} | {even:.2f} |")


if __name__ == "__main__":
    main()
