"""Coats: what they can be, and what is left of a stack to evaluate."""

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.coat import Coat, baked
from pica.scene.material import Image, Material, Texture

GREY = Texture(Image(np.full((2, 2, 4), 128, np.uint8)))
AMBER = Coat(absorption=(100.0, 200.0, 400.0), thickness=0.002)


def test_what_is_left_of_light_follows_beer_and_lambert():
    np.testing.assert_allclose(AMBER.transmittance, np.exp([-0.2, -0.4, -0.8]))
    assert Coat(thickness=1.0).transmittance == (1, 1, 1)


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: Coat(ior=0.9), "coat: ior: 0.9"),
        (lambda: Coat(strength=1.5), "coat: strength: 1.5"),
        (lambda: Coat(absorption=(1, 2)), "coat: absorption"),
        (lambda: Coat(thickness=-1), "coat: thickness: -1"),
        (lambda: Material(coats=(Coat(),) * 4), "material: coats: 4 coats are more than 3"),
        (lambda: Material(coats=("varnish",)), "material: coats: 'varnish' is not a Coat"),
        (lambda: Material(coats=Coat()), "material: coats"),
    ],
)
def test_what_does_not_fit_is_refused(make, fault):
    with pytest.raises(SceneError, match=fault):
        make()


def test_neighbours_of_one_index_of_refraction_become_one():
    under = Coat(roughness=0.5, absorption=(50.0, 0.0, 0.0), thickness=0.004, air_below=True)
    (one,) = baked(Material(coats=(AMBER, under)))
    np.testing.assert_allclose(one.transmittance, np.multiply(AMBER.transmittance, under.transmittance))
    assert one.roughness == AMBER.roughness and one.air_below, "what mirrors is the upper side alone"
    (three_in_one,) = baked(Material(coats=(AMBER, AMBER, AMBER)))
    np.testing.assert_allclose(three_in_one.transmittance, np.power(AMBER.transmittance, 3))


@pytest.mark.parametrize(
    "stack",
    [
        (Coat(), Coat(ior=1.6)),
        (Coat(air_below=True), Coat()),
        (Coat(strength=0.5), Coat()),
        (Coat(), Coat(strength=0.5)),
    ],
)
def test_what_is_seen_stays(stack):
    assert tuple(baked(Material(coats=stack))) == stack


def test_a_coat_that_does_not_cover_goes():
    assert tuple(baked(Material(coats=(Coat(strength=0.0), AMBER)))) == (AMBER,)


def test_where_a_texture_takes_the_upper_coat_away_the_lower_one_shows():
    stack = (Coat(), AMBER)
    assert tuple(baked(Material(coats=stack, coat_texture=GREY))) == stack
    assert len(baked(Material(coats=(AMBER, *stack), coat_texture=GREY))) == 2


def test_a_texture_stays_with_the_topmost():
    stack = (Coat(strength=0.0), AMBER)
    assert tuple(baked(Material(coats=stack, coat_roughness_texture=GREY))) == stack
