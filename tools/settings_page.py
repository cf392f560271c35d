"""Write the tables of docs/guide/settings.md from the schema, between its two marks.

python tools/settings_page.py
"""

from pathlib import Path
from textwrap import wrap
from typing import Any

from pica.settings import Settings

PAGE = Path(__file__).parent.parent / "docs" / "guide" / "settings.md"
EXAMPLE_MARKS = "<!-- example: tools/settings_page.py writes it -->", "<!-- end of example -->"
MARKS = "<!-- tables: tools/settings_page.py writes them -->", "<!-- end of tables -->"


def main() -> None:
    """Write the page."""
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def renewed(page: str) -> str:
    """The page with the example and the tables of today's schema."""
    for marks, text in ((EXAMPLE_MARKS, example()), (MARKS, tables())):
        before, rest = page.split(marks[0])
        page = "\n".join([before + marks[0], "", text, rest[rest.index(marks[1]) :]])
    return page


def example() -> str:
    """What the schema holds, as Python's prompt would show it."""
    schema = Settings.schema()
    shown = {
        'schema["settings"]["shadows.max_lights"]': schema["settings"]["shadows.max_lights"],
        'schema["settings"]["shadows.mode"]["choices"]': schema["settings"]["shadows.mode"]["choices"],
        'schema["groups"]["shadows"]["levels"]': schema["groups"]["shadows"]["levels"],
        'schema["presets"]["raster"]["values"]': schema["presets"]["raster"]["values"],
    }
    lines = ["```python", "schema = pica.Settings.schema()"]
    for code, value in shown.items():
        long = {name: f"{each[:28]}…" for name, each in value.items() if isinstance(each, str) and len(each) > 30}
        lines += [code, *(f"# {line}" for line in wrap(str({**value, **long}), 120))]
    return "\n".join([*lines, "```", ""])


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
