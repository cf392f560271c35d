"""One bounce off brushed metal against Mitsuba's roughconductor."""

import numpy as np
import pytest
import slangpy as spy

from tests.reference.variant import dr, mi
from tests.shaders.conftest import device, load  # noqa: F401
from tests.shaders.test_brdf import hemisphere
from tests.shaders.test_lobes import given, shader  # noqa: F401

pytestmark = [pytest.mark.thorough, pytest.mark.device]


@pytest.mark.parametrize(("roughness", "strength", "turn"), [(0.3, 0.7, 0.0), (0.5, 0.4, 1.1)])
def test_density_and_value_are_mitsubas(shader: spy.Module, roughness: float, strength: float, turn: float) -> None:  # noqa: F811
    """Mitsuba masks and shadows apart from each other, Smith's way, and we together: the quotient of both is known."""
    across = roughness**2
    along = across + (1 - across) * strength**2
    metal = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha_u": along, "alpha_v": across}
    bsdf = mi.load_dict(metal)
    view, light = hemisphere(3000, 1), hemisphere(3000, 2)
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    views, lights = view @ turned.T, light @ turned.T  # in the frame of the tangent
    si = dr.zeros(mi.SurfaceInteraction3f, len(view))
    si.wi = mi.Vector3f(views.T.astype(np.float32))
    outgoing = mi.Vector3f(lights.T.astype(np.float32))
    density = np.array(bsdf.pdf(mi.BSDFContext(), si, outgoing))
    value = np.array(bsdf.eval(mi.BSDFContext(), si, outgoing))[0]

    def smith(direction: np.ndarray) -> np.ndarray:
        slopes = direction[:, :2] / direction[:, 2:] * [along, across]
        return 0.5 * (np.sqrt(1 + (slopes**2).sum(1)) - 1)

    apart, together = (1 + smith(views)) * (1 + smith(lights)), 1 + smith(views) + smith(lights)
    got = shader.mirror(given(metallic=1.0, roughness=roughness, grain=(strength, turn)), view, light, _result="numpy")
    np.testing.assert_allclose(got[:, 0], density, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(got[:, 1], value * apart / together, rtol=1e-3, atol=1e-5)
