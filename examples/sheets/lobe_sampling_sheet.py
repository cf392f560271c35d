"""How directions of reflection rays are drawn: below the horizon, and among the layers of a coated surface.

As figures 25-11 and 25-12 of Barré-Brisebois et al. 2019, "Hybrid Rendering for Real-Time Ray Tracing", have it. Above:
metal balls of GGX's alpha 0.04 to 1, how many directions lead below the horizon, eight rays a pixel where these are
lost and where they are mirrored to above it. Below: lacquer over metal, varnish over wood, three coats over matter,
eight rays a pixel where each layer is as likely as the others, and where what is seen of it decides. All of them take
the same random numbers and see the same sky; errors are root mean squares over the mean light.

    python examples/sheets/lobe_sampling_sheet.py sheet.png
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray
from slangpy.core.calldata import SLANG_PATH

import pica
from pica import quality
from pica.images import pictures

SOURCE = """
import shaders.brdf;
import shaders.microfacets;
import shaders.sampling;
export static const bool COATS_IN_USE = true;

// red of the base colour, metallic, roughness, F0; of each coat strength, roughness, index of refraction, air below
struct Layers { float4 base; float4 coats[3]; uint count; };

BrdfParameters surface(Layers layers)
{
    float4 base = layers.base;
    BrdfParameters p;
    p.baseColor = base.x * float3(1, .5, .25);
    p.metallic = base.y;
    p.roughness = base.z;
    p.dielectricF0 = base.w;
    p.dielectricF90 = base.w > 0 ? 1 : 0;
    p.coats = Coats.none();
    p.coats.count = layers.count;
    float above = 1;
    for (uint i = 0; i < layers.count; ++i)
    {
        float4 c = layers.coats[i];
        p.coats.coats[i] = { c.x, c.y, reflectanceBetween(above, c.z), grazingReflectanceBetween(above, c.z), c.z, 1 };
        above = c.w > 0 ? 1 : c.z;
    }
    return p;
}

float4 seen(float3 direction, float3 weight) { return float4(direction, dot(weight, float3(.2126, .7152, .0722))); }

// Direction and weight.
float4 lost(Layers layers, float3 view, float3 u)
{
    let s = sampleBrdf(surface(layers), view, u);
    return seen(s.direction, s.weight);
}
float4 mirrored(Layers layers, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(layers), view).sampleSpecular(u);
    return seen(s.direction, s.weight);
}
float4 even(Layers layers, float3 view, float3 u)
{
    BrdfParameters p = surface(layers);
    uint lobes = p.coats.count + 2, chosen = min(uint(u.z * lobes), lobes - 1);
    float3 light = sampleCosineHemisphere(u.xy);
    if (chosen == 0)
        light = sampleMirror(view, alphaOf(p.roughness), u.xy);
    else if (chosen <= p.coats.count)
        light = p.coats.sampleMirrorOf(chosen - 1, view, u.xy);
    if (light.z <= 0)
        return float4(0, 0, 1, 0);
    float density = mirrorPdf(view, light, alphaOf(p.roughness)) + cosineHemispherePdf(light.z);
    for (uint i = 0; i < p.coats.count; ++i)
        density += p.coats.mirrorDensity(i, view, light);
    return seen(light, evaluateBrdf(p, view, light).total * lobes / max(density, 1e-20));
}
"""
METALS = [((0.9, 1.0, alpha**0.5, 0.04), ()) for alpha in (0.04, 0.25, 1.0)]
COATED = [
    ((0.5, 1.0, 0.5, 0.04), ((1.0, 0.1, 1.5, 1.0),)),
    ((0.3, 0.0, 0.8, 0.02), ((1.0, 0.1, 1.5, 1.0),)),
    ((0.5, 0.0, 0.6, 0.0), ((1, 0.1, 1.5, 0), (1, 0.4, 1.9, 0), (1, 0.3, 1.3, 0))),
]
TITLES = {
    ("lost", "mirrored"): ("lost", "mirrored to above"),
    ("even", "lost"): ("layers as likely", "by what is seen"),
}
Floats = NDArray[np.float32]


def sky(direction: Floats) -> Floats:
    """(n,) light from directions (n, 3) of the world: a bright window, a sky, a dark ground."""
    window = (np.abs(direction[:, 0] + 0.5) < 0.2) & (np.abs(direction[:, 1] - 0.5) < 0.25) & (direction[:, 2] > 0)
    return np.where(window, 6.0, np.where(direction[:, 1] > 0, 0.3 + 0.4 * direction[:, 1], 0.05)).astype(np.float32)


class Ball:
    """What each pixel of a ball's picture sees, in the frame of its normal."""

    def __init__(self, size: int) -> None:
        x, y = np.meshgrid(*(np.linspace(-1.05, 1.05, size),) * 2)
        self.there = x**2 + y**2 < 0.999
        x, y = x[self.there], -y[self.there]
        self.z = np.stack([x, y, np.sqrt(1 - x**2 - y**2)], -1)
        side = np.cross([0.0, 1.0, 0.001], self.z)
        self.x = side / np.linalg.norm(side, axis=1, keepdims=True)
        self.y = np.cross(self.z, self.x)
        self.view = np.stack([axis[:, 2] for axis in (self.x, self.y, self.z)], -1).astype(np.float32)

    def light(self, drawn: Floats) -> Floats:
        """(n,) from sampled directions and weights (n, 4)."""
        world = self.x * drawn[:, :1] + self.y * drawn[:, 1:2] + self.z * drawn[:, 2:3]
        return sky(world) * drawn[:, 3]


def mean_light(shader: spy.Module, way: str, ball: Ball, surface: Any, rays: int, seed: int) -> tuple[Floats, Floats]:
    """(n,) mean light of so many rays a pixel, and the share of them that weigh nothing."""
    base, coats = surface
    rows = [[*map(float, coat)] for coat in coats] + [[0.0] * 4] * (3 - len(coats))
    layers = {"_type": "Layers", "base": [*map(float, base)], "coats": rows, "count": len(coats)}
    noise, light, nothing = np.random.default_rng(seed), np.zeros(len(ball.view)), np.zeros(len(ball.view))
    for _ in range(rays):
        u = noise.random(ball.view.shape, np.float32)
        drawn = getattr(shader, way)(layers, ball.view, u, _result="numpy")
        light += ball.light(drawn)
        nothing += drawn[:, 3] <= 0
    return (light / rays).astype(np.float32), (nothing / rays).astype(np.float32)


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="How directions of reflection rays are drawn, on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", type=int, default=96, help="pixels across a ball")
    parser.add_argument("--rays", type=int, default=8, help="a pixel")
    parser.add_argument("--samples", type=int, default=512, help="many rays")
    arguments = parser.parse_args()
    paths = [Path(pica.__file__).parent, SLANG_PATH]
    device = spy.Device(type=spy.DeviceType.vulkan, compiler_options={"include_paths": paths})
    shader = spy.Module(device.load_module_from_source("lobe_sampling_sheet", SOURCE))
    ball, pages = Ball(arguments.size), []

    def strip(values: list[Floats]) -> Floats:
        page = np.zeros((len(values), *ball.there.shape), np.float32)
        page[:, ball.there] = values
        return np.concatenate(list(page), axis=1)

    for surfaces, ways in ((METALS, ("lost", "mirrored")), (COATED, ("even", "lost"))):
        truth = [mean_light(shader, ways[-1], ball, surface, arguments.samples, 1)[0] for surface in surfaces]
        panels: dict[str, Any] = {}
        for way, title in zip(ways, TITLES[ways], strict=True):
            found = [mean_light(shader, way, ball, surface, arguments.rays, 2) for surface in surfaces]
            if way == "lost" and surfaces is METALS:
                panels["share below the horizon"] = strip([nothing for _, nothing in found])
                print("below the horizon:", ", ".join(f"{nothing.mean():.3f}" for _, nothing in found))
            errors = [
                np.sqrt(np.mean((light - exact) ** 2)) / exact.mean()
                for (light, _), exact in zip(found, truth, strict=True)
            ]
            caption = f"{title}: " + ", ".join(f"{error:.3f}" for error in errors)
            print(caption)
            panels[caption] = picture(strip([light for light, _ in found]))
        panels[f"{arguments.samples} rays a pixel"] = picture(strip(truth))
        pages.append(quality.sheet(panels))
    width = max(page.shape[1] for page in pages)
    pages = [np.pad(page, ((0, 0), (0, width - page.shape[1]), (0, 0)), constant_values=24) for page in pages]
    pictures.write_png(arguments.output, np.concatenate(pages))


def picture(light: Floats) -> Floats:
    """(height, width, 3) sRGB of (height, width) light."""
    return quality.exposed(np.repeat(light[..., None], 3, -1), 1.0)


if __name__ == "__main__":
    main()
