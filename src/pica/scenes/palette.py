"""The toy world's materials: clay, glossy plastic, metals, rubber and lamps in a few kind colours."""

from dataclasses import dataclass, field

from pica.scene.light import Color
from pica.scene.material import Material


def linear(code: str) -> Color:
    """Linear Rec. 709 from "#rrggbb" in sRGB (IEC 61966-2-1)."""
    values = (int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values)
    return red, green, blue


def clay(name: str, code: str) -> Material:
    """Matt, with next to no highlight."""
    return Material(name, base_color=(*linear(code), 1.0), metallic=0.0, roughness=0.85, specular=0.4)


def plastic(name: str, code: str, roughness: float = 0.25) -> Material:
    """Smooth toy plastic."""
    return Material(name, base_color=(*linear(code), 1.0), metallic=0.0, roughness=roughness)


def metal(name: str, code: str, roughness: float) -> Material:
    """Bare metal; the colour is its reflection straight on."""
    return Material(name, base_color=(*linear(code), 1.0), metallic=1.0, roughness=roughness)


def lamp(name: str, code: str, radiance: float) -> Material:
    """Emits `radiance` nits in the brightest channel."""
    color = linear(code)
    red, green, blue = (radiance * c / max(color) for c in color)
    return Material(name, base_color=(0.6, 0.6, 0.6, 1.0), metallic=0.0, roughness=0.4, emission=(red, green, blue))


def flesh(name: str, code: str, roughness: float) -> Material:
    """Ripe fruit: half of the light goes in below the skin, and a centimetre far before it is scattered."""
    color = linear(code)
    scattering = 90.0
    red, green, blue = (scattering * 0.5 * (1 - c) ** 3 + 0.5 for c in color)
    return Material(
        name, base_color=(*color, 1.0), metallic=0.0, roughness=roughness, diffuse_transmission=0.6, thin_walled=False,
        scattering=(scattering,) * 3, absorption=(red, green, blue),
    )  # fmt: skip


def clear(name: str) -> Material:
    """A thin pane of glass."""
    return Material(name, metallic=0.0, roughness=0.0, transmission=1.0)


@dataclass(frozen=True)
class Palette:
    """One set of materials, shared by everything in one world."""

    ground: Material = field(default_factory=lambda: clay("ground", "#9fb6d4"))
    floor: Material = field(default_factory=lambda: clay("floor", "#f3e8d8"))
    tile: Material = field(default_factory=lambda: clay("tile", "#e2d3c0"))
    white: Material = field(default_factory=lambda: plastic("white plastic", "#f1ede4", 0.3))
    black: Material = field(default_factory=lambda: plastic("black gloss", "#16181d", 0.12))
    dark: Material = field(default_factory=lambda: plastic("navy plastic", "#38465e", 0.4))
    rubber: Material = field(default_factory=lambda: clay("rubber", "#3b3a3d"))
    steel: Material = field(default_factory=lambda: metal("brushed steel", "#c9ccd0", 0.38))
    copper: Material = field(default_factory=lambda: metal("copper", "#f2a98a", 0.22))
    brass: Material = field(default_factory=lambda: metal("brass", "#f0cf85", 0.3))
    wood: Material = field(default_factory=lambda: clay("wood", "#c99463"))
    leaf: Material = field(default_factory=lambda: clay("leaf", "#6f9f58"))
    orange: Material = field(default_factory=lambda: plastic("orange peel", "#f39a2e", 0.45))
    apple: Material = field(default_factory=lambda: plastic("apple skin", "#d8453c", 0.22))
    plum: Material = field(default_factory=lambda: plastic("plum skin", "#7d5a97", 0.35))
    dome: Material | None = None
    """Of the robots' helmets; None: they have none."""
    warm_lamp: Material = field(default_factory=lambda: lamp("warm lamp", "#ffd9a0", 14.0))
    red_lamp: Material = field(default_factory=lambda: lamp("red lamp", "#ff6a50", 8.0))
    fire: Material = field(default_factory=lambda: lamp("oven glow", "#ff9a4a", 12.0))
    red: Material = field(default_factory=lambda: plastic("red plastic", "#d9483b"))
    eye: Material = field(default_factory=lambda: lamp("eye glow", "#7fe9ff", 6.0))
    accents: tuple[Material, ...] = field(
        default_factory=lambda: (
            plastic("coral plastic", "#f48d75"),
            clay("teal clay", "#7ac7bb"),
            plastic("mustard plastic", "#f5c95c"),
            clay("lavender clay", "#bbb0e2"),
            plastic("mint plastic", "#b4dfca"),
            clay("sky clay", "#9bc5e5"),
        )
    )

    @staticmethod
    def with_glass() -> "Palette":
        """With what lets light through: helmets of glass, translucent fruit."""
        return Palette(
            orange=flesh("orange peel", "#f39a2e", 0.45),
            apple=flesh("apple skin", "#d8453c", 0.22),
            plum=flesh("plum skin", "#7d5a97", 0.35),
            dome=clear("helmet"),
        )

    @property
    def lamps(self) -> tuple[Material, Material, Material]:
        """The colours of buttons."""
        return self.warm_lamp, self.red_lamp, self.eye
