"""A chart of a compiled graph as an SVG picture.

Passes are rows, resources columns: a bar from the first pass that uses a resource to the last, a mark where a
pass reads or writes it. Resources that share memory have a common frame.
"""

from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from pica.text import one_line

if TYPE_CHECKING:
    from pica.graph.description import GraphDescription, PassInfo, ResourceInfo

_PALETTE = "4269d0e0822e2f9e6ed1495b8a5fbf2a9db5a0703cc65b9b7a8b1f5b6b7ab8860b3d7a3d9b3d3d3d5a9b"
COLORS = [f"#{_PALETTE[first : first + 6]}" for first in range(0, len(_PALETTE), 6)]
_ROW, _COLUMN, _GAP = 19, 15, 7
_LEFT, _TOP, _FOOT = 404, 182, 74
_TIME_LEFT, _TIME_WIDTH = 280, 64
_STYLE = (
    "text{font:11px system-ui,'DejaVu Sans',sans-serif;fill:#24292f}.s{font-size:10px;fill:#57606a}"
    ".g{fill:#8c959f}.h{font-size:17px;font-weight:600}.e{font-weight:600}.n{text-anchor:end}"
)


def svg(graph: "GraphDescription", title: str) -> str:
    """The picture."""
    return "\n".join(_Chart(graph, title).lines()) + "\n"


class _Chart:
    def __init__(self, graph: "GraphDescription", title: str) -> None:
        self._graph, self._title = graph, title
        used = {key for node in graph.passes for key in _uses(node)}
        # Nodes without resources, such as decisions of the host, are omitted.
        touching = (n for n, node in enumerate(graph.passes) if _uses(node) or node.milliseconds)
        self._rows = {number: row for row, number in enumerate(touching)}
        effects = dict.fromkeys(
            [*(node.effect for node in graph.passes), *(resource.effect for resource in graph.resources)]
        )
        self._colors = {name: COLORS[number % len(COLORS)] for number, name in enumerate(effects)}
        resources = sorted((info for info in graph.resources if info.key in used), key=lambda info: info.lane)
        self._lanes = [list(group) for _, group in groupby(resources, key=lambda resource: resource.lane)]
        self._lanes.sort(key=lambda lane: (min(resource.first for resource in lane), lane[0].lane))
        self._x: dict[str, float] = {}
        right = float(_LEFT)
        for lane in self._lanes:
            for resource in lane:
                self._x[resource.key] = right + _COLUMN / 2
                right += _COLUMN
            right += _GAP
        self._bottom = _TOP + len(self._rows) * _ROW
        self._width = max(right + 70, 900)
        self._height = self._bottom + _FOOT + 16 * (len(self._effect_rows()) // 4 + 3)

    def lines(self) -> Iterator[str]:
        size = f'width="{self._width:.0f}" height="{self._height}" viewBox="0 0 {self._width:.0f} {self._height}"'
        yield f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
        yield f"<style>{_STYLE}</style>"
        yield f'<rect width="{self._width:.0f}" height="{self._height}" fill="#fff"/>'
        yield from self._head()
        yield from self._passes()
        yield from self._resources()
        yield from self._marks()
        yield from self._sums()
        yield "</svg>"

    def _y(self, number: int) -> float:
        """The middle of a pass's row; of the next one that is shown where it is not."""
        later = [row for pass_number, row in self._rows.items() if pass_number >= number]
        return _TOP + _ROW * (min(later, default=len(self._rows) - 1) + 0.5)

    def _head(self) -> Iterator[str]:
        whole, total = sum(self._graph.memory.values()), sum(self._graph.milliseconds.values())
        yield text(16, 30, self._title, "h")
        counts = f"{len(self._rows)} passes, {len(self._x)} resources"
        yield text(16, 50, f"{counts}, {total:.2f} ms, {_megabytes(whole)}")
        marks = {"write": "writes anew", "update": "reads and writes", "read": "reads", "previous": "frame before"}
        for number, (kind, meaning) in enumerate(marks.items()):
            yield _mark(kind, 22, 74 + 16 * number, "#57606a")
            yield text(34, 78 + 16 * number, meaning, "s")
        yield '<path d="M146 66h14v46h-14z" fill="#f0f2f4" stroke="#c4ccd4"/>'
        yield text(168, 92, "one memory, several resources", "s")
        yield '<path d="M153 118v16" stroke="#57606a" stroke-dasharray="2 2"/>'
        yield text(168, 130, "lasts beyond the frame: kept, or a history", "s")
        yield text(146, 148, "name", "g") + text(180, 148, "not in every frame", "s")
        yield text(_TIME_LEFT + _TIME_WIDTH, _TOP - 8, "ms", "s n")

    def _passes(self) -> Iterator[str]:
        slowest = max((node.milliseconds or 0 for node in self._graph.passes), default=0) or 1
        passes = [(row, self._graph.passes[number]) for number, row in self._rows.items()]
        for effect, group in groupby(passes, key=lambda item: item[1].effect):
            rows = [row for row, _ in group]
            top, color = _TOP + rows[0] * _ROW, self._colors[effect]
            yield box(0, top, self._width, len(rows) * _ROW, color, 0.06)
            yield box(0, top, 5, len(rows) * _ROW, color)
            yield text(12, top + 13, effect.replace("_", " "), "e", color)
        for row, node in passes:
            y = _TOP + row * _ROW
            yield f'<path d="M0 {y}H{self._width:.0f}" stroke="#d8dee4" stroke-width=".5"/>'
            note = f"{node.name} of {node.effect}, {node.where}" + (", not in every frame" if node.conditional else "")
            if node.bytes is not None:
                note += f", {_megabytes(node.bytes)} copied between devices"
            name = text(142, y + 13, _short(node.name, 23), "g" if node.conditional else "")
            yield f"<g><title>{_plain(note)}</title>{name}</g>"
            if node.milliseconds is not None:
                wide = _TIME_WIDTH * node.milliseconds / slowest
                yield box(_TIME_LEFT + 4 + _TIME_WIDTH, y + 5, max(wide, 1) * 0.6, 9, self._colors[node.effect], 0.75)
                yield text(_TIME_LEFT + _TIME_WIDTH, y + 13, f"{node.milliseconds:.2f}", "s n")

    def _resources(self) -> Iterator[str]:
        for lane in self._lanes:
            left, right = self._x[lane[0].key] - _COLUMN / 2, self._x[lane[-1].key] + _COLUMN / 2
            if len(lane) > 1:
                high = self._bottom - _TOP + 8
                place = f'x="{left - 1}" y="{_TOP - 4}" width="{right - left + 2}" height="{high}"'
                yield f'<rect {place} rx="4" fill="#57606a" fill-opacity=".08" stroke="#c4ccd4"/>'
            yield _turned(
                (left + right) / 2 + 4, self._bottom + 10, 60, _megabytes(max(resource.bytes for resource in lane))
            )
            for resource in lane:
                yield from self._bar(resource)

    def _bar(self, resource: "ResourceInfo") -> Iterator[str]:
        x, color = self._x[resource.key], self._colors[resource.effect]
        top, bottom = self._y(resource.first) - 7, self._y(resource.last) + 7
        yield f"<g><title>{_plain(self._tip(resource))}</title>"
        if resource.lifetime != "frame":
            whole = f"M{x} {_TOP}V{self._bottom}"
            yield f'<path d="{whole}" stroke="{color}" stroke-dasharray="2 3" stroke-opacity=".6"/>'
        yield box(x - 4, top, 8, bottom - top, color, 0.35)
        yield _turned(x + 3, _TOP - 9, -60, _short(resource.name, 30), color) + "</g>"

    def _tip(self, resource: "ResourceInfo") -> str:
        size = "x".join(map(str, resource.size)) + (f", {resource.layers} layers" if resource.layers else "")
        shares = ", ".join(other.key for other in self._graph.sharing(resource))
        memory = f"{_megabytes(resource.bytes)}, {resource.lifetime}"
        what = f"{resource.key}: {resource.format} {size} {memory}, {resource.where}"
        return what + (f"; memory of {shares} too" if shares else "")

    def _marks(self) -> Iterator[str]:
        for number in self._rows:
            node = self._graph.passes[number]
            for key, kind in _uses(node).items():
                color = self._colors[key.split("/")[0]]
                yield _mark(kind, self._x[key], self._y(number), color)

    def _effect_rows(self) -> list[tuple[str, float, int]]:
        times, memory = self._graph.milliseconds, self._graph.memory
        names = dict.fromkeys([*times, *memory])
        return [(name, times.get(name, 0.0), memory.get(name, 0)) for name in names]

    def _sums(self) -> Iterator[str]:
        top = self._bottom + _FOOT
        yield text(16, top, "By effect", "e")
        for number, (name, milliseconds, size) in enumerate(self._effect_rows()):
            x, y = 16 + 220 * (number % 4), top + 20 + 16 * (number // 4)
            yield box(x, y - 9, 10, 10, self._colors.get(name, "#c4ccd4"))
            said = [f"{milliseconds:.2f} ms"] * bool(milliseconds) + [_megabytes(size)] * bool(size)
            yield text(x + 15, y, f"{name.replace('_', ' ')}: {', '.join(said) or 'nothing'}", "s")


def _uses(node: "PassInfo") -> Mapping[str, str]:
    """How a pass uses each resource, the most important use last."""
    uses = dict.fromkeys(node.previous, "previous") | dict.fromkeys(node.reads, "read")
    return uses | {key: "update" if key in node.reads else "write" for key in node.writes}


def _mark(kind: str, x: float, y: float, color: str) -> str:
    if kind == "read":
        return f'<circle cx="{x}" cy="{y}" r="3.2" fill="#fff" stroke="{color}" stroke-width="1.6"/>'
    if kind == "previous":
        return f'<path d="M{x - 4} {y}l4 -4 4 4 -4 4z" fill="#fff" stroke="{color}" stroke-width="1.4"/>'
    inner = f'<circle cx="{x}" cy="{y}" r="2" fill="#fff"/>' if kind == "update" else ""
    return f'<rect x="{x - 4}" y="{y - 4}" width="8" height="8" rx="1" fill="{color}"/>{inner}'


def box(x: float, y: float, width: float, height: float, color: str, opacity: float = 1) -> str:
    """A filled rectangle of an SVG."""
    place = f'x="{x:g}" y="{y:g}" width="{width:.5g}" height="{height:g}"'
    return f'<rect {place} fill="{color}" fill-opacity="{opacity:g}"/>'


def text(x: float, y: float, text: str, kind: str = "", color: str = "") -> str:
    """A line of text of an SVG, of a class of its style sheet."""
    style = f' style="fill:{color}"' if color else ""
    return f'<text x="{x:g}" y="{y:g}" class="{kind}"{style}>{_plain(text)}</text>'


def _turned(x: float, y: float, degrees: int, text: str, color: str = "#57606a") -> str:
    place = f'transform="translate({x:g} {y:g}) rotate({degrees})"'
    return f'<text {place} style="fill:{color};font-size:10px">{_plain(text)}</text>'


def _plain(text: str) -> str:
    return escape(one_line(text))


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _megabytes(size: int) -> str:
    if size < 1e3:
        return f"{size} B"
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"
