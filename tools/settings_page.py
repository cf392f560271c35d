"""Write the tables of docs/guide/settings.md from the schema, between its two marks.

python tools/settings_page.py
"""

from pathlib import Path
from typing import Any

from pica.settings import Settings

PAGE = Path(__file__).parent.parent / "docs" / "guide" / "settings.md"
MARKS = "<!-- tables: tools/settings_page.py writes them -->", "<!-- end of tables -->"


def main() -> None:
    """Write the page."""
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def renewed(page: str) -> str:
    """The page with tables of today's schema."""
    before, rest = page.split(MARKS[0])
    return "\n".join([before + MARKS[0], "", tables(), rest[rest.index(MARKS[1]) :]])


def tables() -> str:
    """Presets, and for each group its levels and its settings, as Markdown."""
    schema = Settings.schema()
    lines = ["## Presets", "", "| preset | | changes |", "|---|---|---|"]
    for name, preset in schema["presets"].items():
        changes = ", ".join(f"`{path}={_text(value)}`" for path, value in preset["values"].items())
        lines.append(f"| `{name}` | {preset['text']} | {changes} |")
    for name, group in [*schema["groups"].items(), ("", {"text": "Outside of all groups.", "levels": {}})]:
        settings = {path: each for path, each in schema["settings"].items() if path.rpartition(".")[0] == name}
        lines += ["", f"## {name or 'others'}", "", group["text"], ""]
        lines += [f"* `{name}={level}`: {text}" for level, text in group["levels"].items()]
        lines += ["", "| setting | default | allowed | levels | |", "|---|---|---|---|---|"]
        lines += [f"| `{path}` | {' | '.join(cells(setting))} |" for path, setting in settings.items()]
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


def cells(setting: dict[str, Any]) -> list[str]:
    """Default, what is allowed, values at the levels, and what the setting does."""
    if setting["type"] == "boolean":
        allowed = "true, false"
    elif setting["type"] == "choice":
        allowed = ", ".join(setting["choices"])
    else:
        low, high = setting["range"]
        allowed = f"{_text(low)} to {_text(high)} {setting['unit']}".rstrip()
    texts = [setting["text"], *(f"`{value}`: {text}" for value, text in setting.get("choices", {}).items())]
    texts += [f"{way.capitalize()}: {setting[way]}." for way in ("higher", "lower") if setting.get(way)]
    levels = ", ".join(f"{level} {_text(value)}" for level, value in setting.get("levels", {}).items())
    return [_text(setting["default"]), allowed, levels, " ".join(texts)]


def _text(value: Any) -> str:
    """A value as the command line takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
