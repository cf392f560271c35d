"""Whole lights by linearly transformed cosines against the same lights sampled: how far off they are.

PYTHONPATH=. python tests/effects/lighting/area_light_table.py    prints the table of docs/measurements/area-lights.md
"""

import math

import numpy as np
from scipy.stats import qmc

from pica.effects.lighting.ltc_tables import LtcTables
from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE, pack_light
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight, DiskLight, Light, PointLight, RectangleLight, SphereLight, TubeLight
from pica.scenes.placing import aim, move
from tests.tracing.kernels import kernel, read

SOURCE = """
import effects.lighting.ltc_tables;
import effects.lighting.area_light;
import shaders.brdf;
import gpu_scene.lights.lights;
import shaders.surface;
export static const bool LIGHTS_IN_USE = true;
export static const bool FLAT_LIGHTS_IN_USE = true;
export static const bool TUBES_IN_USE = true;

struct Point
{
    float3 view;
    float roughness;
    float3 position;
    float metallic;
}

StructuredBuffer<Light> lights;
StructuredBuffer<Point> points;
StructuredBuffer<float2> numbers;
RWStructuredBuffer<float4> results; // whole light: diffuse, specular; sampled light: diffuse, specular
uint pointCount;
uint numberCount;

// White, on the floor, ior 1.5.
Surface surfaceAt(Point p)
{
    Surface s = {};
    s.position = p.position;
    s.normal = s.geometricNormal = float3(0, 1, 0);
    s.brdf = { 1, p.metallic, p.roughness, .04, 1 };
    return s;
}

[shader("compute")]
[numthreads(32, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    uint index = thread.x / pointCount;
    Point p = points[thread.x % pointCount];
    Surface surface = surfaceAt(p);
    BrdfValue whole = LitSurface.create(surface, p.view, ltcTables).reflected(lights[index]);
    float2 sum = 0;
    for (uint i = 0; i < numberCount; ++i)
    {
        float2 shift = float(thread.x) * float2(.7548777, .5698403);
        LightSample s = sampleLight(lights[index], p.position, frac(numbers[i] + shift));
        if (s.pdf <= 0)
            continue;
        BrdfValue value = surface.evaluate(p.view, s.direction);
        sum += float2(value.diffuse.g, value.specular.g) * s.radiance.g / s.pdf;
    }
    results[thread.x] = float4(whole.diffuse.g, whole.specular.g, sum / numberCount);
}
"""
POINT = np.dtype([("view", "f4", 3), ("roughness", "f4"), ("position", "f4", 3), ("metallic", "f4")])

LIGHTS: dict[str, tuple[Light, np.ndarray]] = {
    "rectangle": (RectangleLight(width=1.5, height=0.8), aim((0.1, 1.0, 0.5), (0, 0, 0.3))),
    "wall": (RectangleLight(width=1.5, height=1.5), aim((1.5, 0.6, 0), (0, 0.5, 0.1))),
    "disk": (DiskLight(radius=0.7), aim((0, 1.2, 0.3), (0.1, 0, 0.1))),
    "standing disk": (DiskLight(radius=0.5), aim((0.6, 0.2, 1.9), (0, 0.1, 0))),
    "sphere": (SphereLight(radius=0.4), move(0.3, 0.8, 0)),
    "sunk sphere": (SphereLight(radius=0.4), move(0.8, 0.1, 0)),
    "point of 5 cm": (PointLight(radius=0.05), move(-0.4, 0.6, 0.2)),
    "sun of 5 degrees": (DirectionalLight(angular_diameter=math.radians(5)), aim((0.5, 1, 0), (0, 0, 0))),
    "tube": (TubeLight(length=1.5, radius=0.03), move(0, 0.7, 0.3)),
    "thick tube": (TubeLight(length=0.6, radius=0.3), move(0.2, 0.7, -0.5)),
    "sharp point": (PointLight(), move(-0.4, 0.6, 0.2)),
}


def floor_points(count: int, roughness: float, metallic: float) -> np.ndarray:
    """(count,) POINT all over three metres of floor, seen from everywhere."""
    u = qmc.Sobol(4, seed=2).random(count)
    points = np.zeros(count, POINT)
    points["position"][:, [0, 2]] = 3 * u[:, :2] - 1.5
    cosine, angle = np.sqrt(0.005 + 0.995 * u[:, 2]), 2 * np.pi * u[:, 3]
    sine = np.sqrt(1 - cosine**2)
    points["view"] = np.stack([sine * np.cos(angle), cosine, sine * np.sin(angle)], 1)
    points["roughness"], points["metallic"] = roughness, metallic
    return points


class Comparison:
    """Compares on one device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._kernel = kernel(device, SOURCE)
        self._tables = LtcTables(device)

    def __call__(self, lights: list[tuple[Light, np.ndarray]], points: np.ndarray, samples: int) -> np.ndarray:
        """(lights, points, 2, 2): whole or sampled, diffuse or specular."""
        table = np.array([pack_light(*light) for light in lights], LIGHT_DTYPE)
        results = self._device.structured("results", np.zeros((len(table) * len(points), 4), np.float32))
        numbers = qmc.Sobol(2, seed=1).random(samples).astype(np.float32)
        with self._device.record() as recording:
            self._kernel(
                recording,
                (len(table) * len(points), 1, 1),
                lights=self._device.structured("lights", table),
                points=self._device.structured("points", points),
                numbers=self._device.structured("numbers", numbers),
                results=results,
                pointCount=len(points),
                numberCount=samples,
                ltcTables=self._tables,
            )
        self._device.handle.wait_for_idle()
        return read(results, np.float32).reshape(len(table), len(points), 2, 2).astype(np.float64)


def apart(points: np.ndarray) -> np.ndarray:
    """(points,) how far the whole light's specular part is from the sampled one: the logarithm of their quotient."""
    whole, sampled = np.maximum(points[..., 1], 1e-9).T
    return np.abs(np.log(whole / sampled))


def main() -> None:
    """Print bias and root mean square error, in percent of the mean, by light and roughness; and `apart`."""
    compare = Comparison(Device())
    for metallic in (0.0, 1.0):
        for roughness in (0.1, 0.2, 0.4, 0.6, 0.8, 1.0):
            found = compare(list(LIGHTS.values()), floor_points(512, roughness, metallic), 4096)
            for name, result in zip(LIGHTS, found, strict=True):
                mean = np.maximum(result[:, 1].mean(0), 1e-9)
                bias = 100 * (result[:, 0].mean(0) / mean - 1)
                error = 100 * np.sqrt(((result[:, 0] - result[:, 1]) ** 2).mean(0)) / mean
                total = 100 * (result[:, 0].sum() / result[:, 1].sum() - 1)
                print(
                    f"{name:16s} metallic {metallic:.0f} roughness {roughness:.1f}:"
                    f" diffuse {bias[0]:6.2f} ({error[0]:4.1f}) specular {bias[1]:6.2f} ({error[1]:5.1f})"
                    f" total {total:6.2f}"
                    f" apart {np.median(apart(result)):.2f}, {np.percentile(apart(result), 90):.2f}"
                )


if __name__ == "__main__":
    main()
