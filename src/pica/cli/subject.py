"""The subject of commands: a scene, its time and its camera, by arguments that all commands share."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli.report import load_progress
from pica.errors import PicaError
from pica.names import did_you_mean
from pica.scene.conversion.formats import SUFFIXES

if TYPE_CHECKING:
    from pica import Camera, Environment, Limits, Node, Scene

BUILT_IN = {
    "demo": "machine_world",
    "machine_world": "machine_world",
    "cornell": "cornell",
    "sphere_grid": "sphere_grid",
    "landscape": "landscape",
    "corridor": "corridor",
    "sphere_sweep": "sphere_sweep",
    "rooms": "rooms",
    "court": "court",
    "showroom": "showroom",
}
LIMITS = ("bytes", "vertices", "instances", "pixels", "expansion")
"""The names in pica.Limits, which is not imported for a help text."""


def _option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text)


def _flag(name: str, text: str) -> Any:
    return typer.Option(name, help=text)


@dataclass(frozen=True)
class View:
    """The arguments of the command line for the subject; `takes_view` adds them to a command."""

    scene: Annotated[
        str, typer.Argument(metavar="SCENE", help=f"A file ({', '.join(SUFFIXES)}), or one of {', '.join(BUILT_IN)}.")
    ]
    env: Annotated[
        Path | None,
        _option("FILE", "Environment, .hdr, .exr or .ktx2 (a cube map); a .png or .jpg is taken as sRGB, 0 to 1 nit."),
    ] = None
    env_strength: Annotated[float | None, _option("X", "Multiplies the environment's light; 0 takes it away.")] = None
    env_rotation: Annotated[
        float | None, _option("DEGREES", "Turns the environment about the vertical axis, from +Z towards +X.")
    ] = None
    background: Annotated[
        str | None,
        _option(
            "#RRGGBB|FILE", "A colour, sRGB, or a picture as of --env to show behind all surfaces; or environment."
        ),
    ] = None
    background_blur: Annotated[float | None, _option("DEGREES", "Blurs the background, such as 5.")] = None
    sun: Annotated[
        str | None,
        _option("ELEVATION,AZIMUTH", "A clear sky and its sun, degrees, north is -Z; or TIME@LATITUDE,LONGITUDE."),
    ] = None
    up: Annotated[
        str | None, _option("y|z", "The axis that points up in the file, if it is not that of its format.")
    ] = None
    variant: Annotated[str | None, _option("NAME", "A variant of the file's materials.")] = None
    camera: Annotated[str | None, _option("NAME", "A camera of the scene.")] = None
    eye: Annotated[str | None, _option("X,Y,Z", "Where to look from, in metres.")] = None
    target: Annotated[str | None, _option("X,Y,Z", "What to look at, in metres.")] = None
    fov: Annotated[float | None, _option("DEGREES", "Vertical field of view in degrees, 45 unless told.")] = None
    f_number: Annotated[
        float | None, _option("N", "Depth of field of a lens with this f-number, on 24 mm of film, such as 2.8.")
    ] = None
    focus_distance: Annotated[
        float | None, _option("M", "Metres to what is in focus with --f-number; without it, what the camera looks at.")
    ] = None
    allow_outside: Annotated[
        bool, _flag("--allow-outside", "Also read files outside SCENE's folder, such as textures in ../")
    ] = False
    limit: Annotated[
        list[str] | None,
        _option("NAME=N", f"What loading may take: {', '.join(LIMITS)}; inf for any. May be repeated."),
    ] = None
    start: Annotated[float | None, _option("S", "The time of the (first) picture, 0 unless told.")] = None
    animation: Annotated[str | None, _option("NAME|N", "The animation to play; without it, all together.")] = None

    def load(self, moving: bool = False) -> "Scene":
        """The scene at its time; `moving`: at 0 s even without a time. Raises PicaError."""
        sky = self._sky()
        environment = self.env if sky is None else sky[0]
        scene = load_scene(self.scene, environment, self.allow_outside, parse_limits(self.limit), self.up, self.variant)
        if sky is not None:
            scene.add(sky[1])
        self._change_environment(scene)
        if self.background is not None:
            scene.background = _background(self.background, parse_limits(self.limit))
        if self.background_blur is not None:
            _blur_background(scene, self.background_blur)
        if moving or self.start is not None or self.animation is not None:
            scene.animate(self.start or 0.0, find_animation(scene, self.animation))
        return scene

    def _change_environment(self, scene: "Scene") -> None:
        if self.env_strength is None and self.env_rotation is None:
            return
        environment = scene.environment
        if environment is None:
            raise PicaError(f"--env-strength, --env-rotation: {self.scene} has no environment; give --env too")
        scene.environment = replace(
            environment,
            strength=environment.strength if self.env_strength is None else self.env_strength,
            rotation=environment.rotation if self.env_rotation is None else math.radians(self.env_rotation),
        )

    def _sky(self) -> "tuple[Environment, Node] | None":
        if self.sun is None:
            return None
        if (self.env, self.env_strength, self.env_rotation) != (None, None, None):
            raise PicaError("--sun takes no --env, --env-strength or --env-rotation beside it")
        from pica.scene.sun import parse_sun, sky

        return sky(*parse_sun(self.sun))

    @property
    def has_camera(self) -> bool:
        """Whether a camera is specified."""
        return (self.camera, self.eye, self.target, self.fov) != (None, None, None, None)

    def camera_in(self, scene: "Scene") -> "Camera | None":
        """The specified camera, in the scene's current state; None for the scene's own. Raises PicaError."""
        import pica

        if self.camera is not None:
            if self.eye or self.target or self.fov is not None:
                raise PicaError("--camera takes no --eye, --target or --fov beside it")
            cameras = {camera.name: camera for camera in scene.cameras()}
            if self.camera not in cameras:
                names = ", ".join(map(repr, cameras)) or "none"
                raise PicaError(f"no camera {self.camera!r} in the scene; there are {names}")
            return cameras[self.camera]
        if self.eye is None and self.target is None and self.fov is None:
            return None
        if self.eye is None or self.target is None:
            raise PicaError("--eye and --target go together; --fov needs both")
        eye, target = _point("--eye", self.eye), _point("--target", self.target)
        degrees = 45.0 if self.fov is None else self.fov
        if not 0 < degrees < 180:
            raise PicaError(f"--fov {degrees:g} is not between 0 and 180 degrees")
        return pica.Camera.look_at(eye, target, vertical_fov=math.radians(degrees))

    def camera_for(self, scene: "Scene", size: tuple[int, int]) -> "Camera":
        """The given camera or the scene's own, with the given lens, for a picture of `size`. Raises PicaError."""
        return self.focused(scene, self.camera_in(scene) or scene.default_camera(size[0] / size[1]))

    def focused(self, scene: "Scene", camera: "Camera") -> "Camera":
        """A camera with the specified lens. Raises PicaError."""
        if self.f_number is None:
            if self.focus_distance is not None:
                raise PicaError("--focus-distance needs --f-number")
            return camera
        distance = self.focus_distance
        if distance is None:
            toward = self.looked_at(scene, camera) - camera.transform[:3, 3]
            distance = max(float(-camera.transform[:3, 2] @ toward), camera.near)
        return replace(camera, f_number=self.f_number, focus_distance=distance)

    def looked_at(self, scene: "Scene", camera: "Camera") -> Any:
        """(3,) the target of a camera of `camera_in` or another one of the scene, in metres."""
        import numpy as np

        from pica.scene.orbit import pivot

        return pivot(scene, camera) if self.target is None else np.array(_point("--target", self.target))


def takes_view(command: Callable[..., None]) -> Callable[..., None]:
    """`command`, whose first parameter is a View, with the View's fields as parameters that Typer can read."""
    _, *own = signature(command).parameters.values()
    shared = signature(View).parameters

    @wraps(command)
    def flat(**given: Any) -> None:
        command(View(**{name: given.pop(name) for name in shared}), **given)

    parameters = [parameter.replace(kind=Parameter.KEYWORD_ONLY) for parameter in (*shared.values(), *own)]
    vars(flat)["__signature__"] = Signature(parameters)
    return flat


def find_animation(scene: "Scene", text: str | None) -> int | str | None:
    """The number or name of an animation for Scene.animate, from `text`."""
    names = {animation.name for animation in scene.animations}
    is_number = text is not None and text not in names and re.fullmatch("[0-9]{1,9}", text)
    return int(text) if text is not None and is_number else text


def parse_limits(texts: list[str] | None) -> "Limits":
    """pica.Limits, changed by texts such as ["pixels=1e9"]. Raises PicaError."""
    import pica

    values = {}
    for text in texts or []:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            raise PicaError(f"--limit {text!r} is not name=number") from None
        if name.strip() not in LIMITS:
            hint = did_you_mean(text.partition("=")[0], LIMITS)
            raise PicaError(f"--limit {text!r}: there are {', '.join(LIMITS)}{hint}")
    return pica.Limits(**values)


def load_scene(
    name: str,
    environment: "Path | Environment | None",
    allow_outside: bool,
    limits: "Limits",
    up: str | None,
    variant: str | None,
) -> "Scene":
    """A built-in scene by its word or a file, lit by an environment or a picture of one. Raises PicaError."""
    import pica
    from pica.scene.limits import Budget
    from pica.scene.loading import read_environment

    if name in BUILT_IN and not Path(name).is_file():
        if up is not None:
            raise PicaError(f"--up {up}: is for files; in the built-in scenes, y points up")
        if variant is not None:
            raise PicaError(f"--variant {variant}: is for files; the built-in scenes have no variants")
        scene: Scene = getattr(pica.scenes, BUILT_IN[name])()
        if environment is not None:
            if isinstance(environment, Path):
                environment = read_environment(environment, Budget(limits))
            scene.environment = environment
        return scene
    if not name or (not Path(name).suffix and not Path(name).exists()):
        hint = did_you_mean(name, BUILT_IN)
        raise PicaError(f"no file and no built-in scene {name!r}; the built-in ones are {', '.join(BUILT_IN)}{hint}")
    with load_progress(f"Loading {Path(name).name}"):
        return pica.load(
            name, environment=environment, allow_outside=allow_outside, limits=limits, up=up, variant=variant
        )


def _background(text: str, limits: "Limits") -> "tuple[float, float, float] | Environment | None":
    """Scene.background of "#404048", "sky.hdr" or "environment". Raises PicaError."""
    import numpy as np

    from pica.color import srgb_decode
    from pica.scene.limits import Budget
    from pica.scene.loading import read_environment

    if text == "environment":
        return None
    if not re.fullmatch("#?[0-9a-fA-F]{6}", text):
        if Path(text).suffix:
            return read_environment(Path(text), Budget(limits))
        raise PicaError(f"--background {text!r} is neither a colour such as '#404048' nor a picture nor environment")
    red, green, blue = srgb_decode(np.array([*bytes.fromhex(text.removeprefix("#"))]) / 255).tolist()
    return red, green, blue


def _blur_background(scene: "Scene", degrees: float) -> None:
    """Raises PicaError where the background is a colour, or nothing."""
    from pica.scene.environment import Environment

    shown = scene.environment if scene.background is None else scene.background
    if not isinstance(shown, Environment) or not 0 <= degrees <= 180:
        raise PicaError(f"--background-blur {degrees:g}: is for environments, from 0 to 180 degrees")
    scene.background = shown.blurred(math.radians(degrees))


def _point(option: str, text: str) -> tuple[float, ...]:
    try:
        point = tuple(float(part) for part in text.split(","))
    except ValueError:
        point = ()
    if len(point) != 3 or not all(abs(part) < 1e9 for part in point):
        raise PicaError(f"{option} {text!r} is not three numbers X,Y,Z in metres")
    return point
