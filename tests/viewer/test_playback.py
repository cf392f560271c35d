"""Time that runs, loops and stops."""

import numpy as np
import pytest

import pica
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.model import Node, Scene
from pica.viewer.playback import Playback


@pytest.fixture
def scene() -> Scene:
    made, node = Scene("test"), Node("mover", pose=Pose())
    made.add(node)
    for name, seconds in (("short", 2.0), ("long", 4.0)):
        ends = np.array([[0, 0, 0], [seconds, 0, 0]])
        made.animations.append(Animation([Channel(node, "translation", np.array([0, seconds]), ends)], name=name))
    return made


def place(scene: Scene) -> float:
    return scene.roots[0].transform[0, 3]


def test_time_runs_while_it_plays(scene):
    playback = Playback(scene, animation="long")
    assert not playback.advance(1.0) and place(scene) == 0
    playback.playing, playback.speed = True, 0.5
    assert playback.advance(1.0) and place(scene) == 0.5
    playback.seek(3.0)
    assert (playback.time, place(scene)) == (3.0, 3.0)


def test_it_loops_or_stops_at_either_end(scene):
    playback = Playback(scene, animation="short")
    playback.playing = True
    playback.advance(5.0)
    assert playback.time == 1.0 and playback.playing
    playback.loop = False
    playback.advance(5.0)
    assert playback.time == 2.0 and not playback.playing and place(scene) == 2.0
    playback.playing, playback.speed = True, -1.0
    playback.advance(5.0)
    assert playback.time == 0.0 and not playback.playing


def test_durations_are_those_of_what_plays(scene):
    playback = Playback(scene)
    assert (playback.names, playback.duration) == (["short", "long"], 4.0)
    playback.choose("short")
    assert playback.duration == 2.0
    playback.choose(1)
    assert playback.duration == 4.0
    with pytest.raises(pica.SceneError, match="no animation 'none'"):
        playback.choose("none")
    assert playback.animation == 1


def test_a_still_scene_has_no_time():
    playback = Playback(Scene("still"))
    playback.playing = True
    assert not playback.advance(1.0) and (playback.names, playback.duration) == ([], 0.0)
