"""What moves in a sequence, and how fast."""

import math

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.quality.sequences import SEQUENCES, sequence
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.orbit import pivot
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, shining, uniform

OUTSIDE = Camera.look_at((0, 6, 3), (0, 0, 0), vertical_fov=np.radians(40))
INSIDE = Camera.look_at((0, 1, 3), (0, 1, 0))
MOVING = {"objects": {"board"}, "moving_light": {"light"}}
CAMERAS = {"orbit", "turn", "dolly"}


def half_hidden(light=None):
    """A floor, and a board above it."""
    return scene_of(
        placed(plane(20, 20, lambert(0.5)), name="floor"),
        placed(box(2, lambert(0.5)), move(1.2, 2, 0) @ np.diag([1, 0.01, 1, 1]), name="board"),
        shining(light or DirectionalLight(), move(0, 5, 0) @ rotate("x", -90)),
    )


@pytest.mark.parametrize("name", SEQUENCES)
def test_sequences_move_what_they_say(name):
    scene = half_hidden()
    play = sequence(name, scene, OUTSIDE)
    before = {node.name: node.world for node in scene.nodes()}
    assert np.allclose(play(0).transform, OUTSIDE.transform)
    camera = play(7)
    moved = {node.name for node in scene.nodes() if not np.allclose(node.world, before[node.name])}
    assert moved == MOVING.get(name, set())
    assert np.allclose(camera.transform, OUTSIDE.transform) == (name not in CAMERAS)
    play(0)
    for node in scene.nodes():
        np.testing.assert_allclose(node.world, before[node.name], atol=1e-12)


def test_an_orbit_keeps_its_distance_from_what_is_looked_at():
    scene = half_hidden()
    center = pivot(scene, OUTSIDE)
    eye = sequence("orbit", scene, OUTSIDE, speed=3.0)(30).transform[:3, 3]
    start = OUTSIDE.transform[:3, 3]
    assert math.dist(eye, center) == pytest.approx(math.dist(start, center))
    np.testing.assert_allclose(eye - center, [start[2] - center[2], start[1] - center[1], 0], atol=1e-9)


def test_an_orbit_within_the_scene_turns_about_the_camera():
    play = sequence("orbit", half_hidden(), INSIDE)
    assert play.name == "turn" and play.numbers() == {
        "sequence": "turn",
        "speed": 1.0,
        "speed_unit": "degrees a frame",
    }
    camera = play(90)
    np.testing.assert_allclose(camera.transform[:3, 3], (0, 1, 3), atol=1e-9)
    np.testing.assert_allclose(-camera.transform[:3, 2], (-1, 0, 0), atol=1e-9)


def test_a_dolly_walks_on_its_level():
    step = sequence("dolly", half_hidden(), OUTSIDE, speed=0.5)(4).transform[:3, 3] - OUTSIDE.transform[:3, 3]
    np.testing.assert_allclose(step, (0, 0, -2), atol=1e-9)
    down = Camera(move(0, 3, 0) @ rotate("x", -90))
    step = sequence("dolly", half_hidden(), down, speed=0.5)(4).transform[:3, 3] - down.transform[:3, 3]
    np.testing.assert_allclose(step, (0, -2, 0), atol=1e-6)


def test_a_dolly_is_slow_in_a_small_scene():
    scene = scene_of(placed(box(0.01, lambert(0.5)), move(0, 0, 0), name="grain"))
    play = sequence("dolly", scene, Camera.look_at((0, 0, 0.1), (0, 0, 0)))
    assert play.speed == pytest.approx(0.001, rel=0.2)


def test_animations_advance_by_the_speed(monkeypatch):
    scene, times = pica.scenes.machine_world(), []
    monkeypatch.setattr(pica.Scene, "animate", lambda self, time, animation: times.append((time, animation)))
    play = sequence("objects", scene, OUTSIDE, start=2.0, animation="belts")
    play(0), play(30)
    sequence("objects", scene, OUTSIDE, speed=0.5)(3)
    assert times == [(2.0, "belts"), (pytest.approx(3.0), "belts"), (1.5, None)]


def strengths(scene, read):
    play = sequence("light", scene, OUTSIDE)
    found = []
    for frame in (0, 15, 16, 31, 32):
        play(frame)
        found.append(read())
    return found


STEPS = [1, 1, pytest.approx(0.2), pytest.approx(0.2), 1]


def test_the_light_changes_in_steps():
    scene = half_hidden(PointLight(intensity=1))
    lamp = next(node for node in scene.nodes() if node.light)
    assert strengths(scene, lambda: lamp.light.intensity) == STEPS


def test_without_lights_an_emitter_changes_and_without_these_the_environment():
    glow = lambert(0.5, emission=(1.0, 0.0, 0.0))
    scene = scene_of(placed(box(1, lambert(0.5))), placed(box(1, glow)), environment=uniform(1, 1, 1))
    assert strengths(scene, lambda: glow.emission[0]) == STEPS
    scene = scene_of(placed(box(1, lambert(0.5))), environment=uniform(1, 1, 1))
    assert strengths(scene, lambda: scene.environment.strength) == STEPS


def test_lamps_sway():
    scene = half_hidden(PointLight())
    lamp = next(node for node in scene.nodes() if node.light)
    sequence("moving_light", scene, OUTSIDE)(30)
    assert np.linalg.norm(lamp.world[:3, 3] - (0, 5, 0)) > 0.1


@pytest.mark.parametrize(
    ("name", "speed", "says"),
    [
        ("dance", None, "'dance' is not one of still, orbit"),
        ("still", 1.0, "still has no speed"),
        ("light", 1.0, "light has no speed"),
        ("orbit", 0.0, "above 0 and at most 90 degrees a frame"),
        ("turn", 91.0, "speed 91"),
        ("objects", math.nan, "seconds a frame"),
        ("dolly", math.inf, "metres a frame"),
        ("dolly", -1.0, "metres a frame"),
    ],
)
def test_wrong_names_and_speeds(name, speed, says):
    with pytest.raises(PicaError, match=says):
        sequence(name, half_hidden(), OUTSIDE, speed=speed)


def test_where_nothing_shines_nothing_is_dimmed():
    with pytest.raises(PicaError, match="no light"):
        sequence("light", scene_of(placed(box(1, lambert(0.5)))), OUTSIDE)


@pytest.mark.parametrize("name", ["objects", "moving_light", "light"])
def test_a_scene_in_which_nothing_moves(name):
    with pytest.raises(PicaError, match=f"sequence {name}: the scene has "):
        sequence(name, scene_of(placed(plane(20, 20, lambert(0.5)))), OUTSIDE)
