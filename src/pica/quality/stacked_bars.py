"""Milliseconds by effect as stacked bars: an SVG picture."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from pica.graph.chart import COLORS, box, text
from pica.images.saving import write_whole

_LEFT, _TOP, _PLOT, _WIDTH, _BAR = 60, 60, 320, 900, 56
_KEY_COLUMNS, _KEY_WIDTH = 4, 210
_STYLE = (
    "text{font:12px system-ui,'DejaVu Sans',sans-serif;fill:#24292f}.h{font-size:16px;font-weight:600}"
    ".g{fill:#57606a}.n{text-anchor:end}.m{text-anchor:middle}"
)


def save_stacked_bars(path: Path, title: str, bars: Mapping[str, Mapping[str, float]]) -> None:
    """Write `stacked_bars` to an .svg. Raises PicaError if it cannot be written."""
    picture = stacked_bars(title, bars)
    write_whole(path, lambda file: file.write_text(picture, encoding="utf-8"))


def stacked_bars(title: str, bars: Mapping[str, Mapping[str, float]]) -> str:
    """A bar for each entry, by its label from left to right; its parts, in milliseconds by effect, from below."""
    return "\n".join(_lines(title, bars)) + "\n"


def _lines(title: str, bars: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    effects = list(dict.fromkeys(effect for parts in bars.values() for effect in parts))
    colors = {effect: COLORS[number % len(COLORS)] for number, effect in enumerate(effects)}
    highest = max((sum(parts.values()) for parts in bars.values()), default=0.0) or 1.0
    bottom = _TOP + _PLOT
    height = bottom + 50 + 18 * -(-len(effects) // _KEY_COLUMNS)
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" height="{height}" viewBox="0 0 {_WIDTH} {height}">'
    )
    yield f'<style>{_STYLE}</style><rect width="{_WIDTH}" height="{height}" fill="#fff"/>'
    yield text(16, 28, title, "h")
    for number in range(5):
        y = bottom - _PLOT * number / 4
        yield f'<path d="M{_LEFT} {y}H{_WIDTH - 20}" stroke="#d8dee4"/>'
        yield text(_LEFT - 6, y + 4, f"{highest * number / 4:.3g}", "n g")
    yield text(_LEFT - 6, _TOP - 14, "ms", "n g")
    step = (_WIDTH - 20 - _LEFT) / max(len(bars), 1)
    for number, (label, parts) in enumerate(bars.items()):
        middle, y = _LEFT + step * (number + 0.5), float(bottom)
        for effect, ms in parts.items():
            y -= _PLOT * ms / highest
            part = box(middle - _BAR / 2, y, _BAR, _PLOT * ms / highest, colors[effect], 0.85)
            yield f"<g>{part}<title>{effect}: {ms:.3g} ms</title></g>"
        yield text(middle, y - 5, f"{sum(parts.values()):.3g}", "m")
        yield text(middle, bottom + 18, label, "m")
    for number, effect in enumerate(effects):
        x, y = _LEFT + _KEY_WIDTH * (number % _KEY_COLUMNS), bottom + 42 + 18 * (number // _KEY_COLUMNS)
        yield box(x, y - 10, 11, 11, colors[effect], 0.85)
        yield text(x + 16, y, effect.replace("_", " "))
    yield "</svg>"
