"""The time of a scene's animations: played, scrubbed, looped."""

import math

from pica.scene.model import Scene

FASTEST = 8.0
"""Times the speed of the animation, of what user interfaces offer."""
_ENDLESS = 10.0
"""Seconds of the range in which the time of animations without an end is chosen."""


class Playback:
    """Sets the scene to a time, which runs while `playing`."""

    def __init__(self, scene: Scene, time: float = 0.0, animation: int | str | None = None) -> None:
        """`time`: seconds, where it begins. `animation`: number or name of the one to play; None: all together. The
        scene stays as it is until either changes."""
        self._scene = scene
        self.time = time
        """Seconds."""
        self.animation = animation
        self.playing = False
        self.speed = 1.0
        """Seconds of animation a second; negative: backwards."""
        self.loop = True
        """Whether it begins again at its end; else it stops there."""

    @property
    def names(self) -> list[str]:
        """Names of the animations, those without one by their number."""
        return [animation.name or str(number) for number, animation in enumerate(self._scene.animations)]

    @property
    def duration(self) -> float:
        """Seconds of what is played; 0: there are no animations, or they are drivers without an end."""
        chosen = [
            animation.duration
            for number, animation in enumerate(self._scene.animations)
            if self.animation is None or self.animation in (number, animation.name)
        ]
        return max(chosen, default=0.0)

    @property
    def longest(self) -> float:
        """Seconds of the range in which a time is chosen: the duration of the longest animation."""
        return max((animation.duration for animation in self._scene.animations), default=0.0) or _ENDLESS

    def seek(self, time: float) -> None:
        """Set the scene to a time in seconds."""
        self._scene.animate(time, self.animation)
        self.time = time

    def choose(self, animation: int | str | None) -> None:
        """Play another animation, from the current time on. Raises SceneError if there is none such."""
        self._scene.animate(self.time, animation)
        self.animation = animation

    def advance(self, seconds: float) -> bool:
        """Let so much time pass. Whether the scene is at another time."""
        step = seconds * self.speed
        if not self.playing or not self._scene.animations or not step or not math.isfinite(step):
            return False
        time, end = self.time + step, self.duration
        if end and self.loop:
            time %= end
        elif end and not 0 <= time <= end:
            time, self.playing = min(max(time, 0.0), end), False
        self.seek(time)
        return True
