"""Costs of frames as HTML: bars by effect, and a chart over time."""

from html import escape

from pica.graph.chart import COLORS
from pica.viewer.costs import Costs
from pica.viewer.texts import span

_WIDTH, _HEIGHT = 320, 90
_ROW = "display:flex;align-items:center;gap:.5em;font-size:.8em;line-height:1.5"


def cost_chart(costs: Costs) -> str:
    """A bar for each effect of the newest frame, longest first, and all frames with their effects one above the
    other."""
    rows = costs.rows
    colors = {name: COLORS[number % len(COLORS)] for number, name in enumerate(sorted({*_names(costs)}))}
    longest = max((time for _, time in rows), default=0.0) or 1.0
    bars = "".join(_bar(name, time, time / longest, colors[name]) for name, time in rows)
    return f'<div style="padding:0 1em">{bars}{_over_time(costs, colors)}<div style="{_ROW}">{span(costs)}</div></div>'


def _names(costs: Costs) -> list[str]:
    return [name for times in costs.history for name in times]


def _bar(name: str, time: float, share: float, color: str) -> str:
    bar = f'<span style="width:{60 * share:.1f}%;height:.8em;background:{color}"></span>'
    return (
        f'<div style="{_ROW}"><span style="width:35%">{escape(name)}</span>'
        f'<span style="flex:1;display:flex;align-items:center;gap:.3em">{bar}{time:.2f} ms</span></div>'
    )


def _over_time(costs: Costs, colors: dict[str, str]) -> str:
    """Stacked areas, the newest frame on the right."""
    highest = max(costs.sums, default=0.0) or 1.0
    step = _WIDTH / max(len(costs.history) - 1, 1)
    below = [0.0] * len(costs.history)
    areas = []
    for name, color in colors.items():
        above = [low + times.get(name, 0.0) for low, times in zip(below, costs.history, strict=True)]
        edge = [(number * step, _HEIGHT * (1 - value / highest)) for number, value in enumerate(above)]
        back = [(number * step, _HEIGHT * (1 - value / highest)) for number, value in enumerate(below)]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in [*edge, *reversed(back)])
        areas.append(f'<polygon points="{points}" fill="{color}"><title>{escape(name)}</title></polygon>')
        below = above
    box = f'viewBox="0 0 {_WIDTH} {_HEIGHT}" preserveAspectRatio="none"'
    return f'<svg {box} style="width:100%;height:{_HEIGHT}px;margin:.5em 0">{"".join(areas)}</svg>'
