"""What README.md and docs/ tell newcomers: their links lead somewhere, their settings exist, their programs run."""

import re
from copy import deepcopy
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import pica
from pica.cli.app import app

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"
DOCS = sorted((ROOT / "docs").rglob("*.md"))
PAGES = [README, *DOCS, ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", ROOT / "examples" / "README.md"]
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


def links(page):
    """(path, anchor) of each link to a file."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", prose)
    return [(page.parent / path if path else page, anchor) for path, anchor in found if "://" not in path]


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_lead_somewhere(page):
    for target, anchor in links(page):
        assert target.exists(), f"{page.name} links to {target}"
        assert not anchor or anchor in anchors(target), f"{page.name} links to #{anchor} of {target.name}"


def test_every_page_and_picture_is_shown_to_newcomers():
    shown = {target.resolve() for page in PAGES for target, _ in links(page)}
    assert {path for path in (ROOT / "docs" / "images").iterdir()} <= shown
    contents = {target.resolve() for target, _ in links(ROOT / "docs" / "README.md")}
    assert set(DOCS) <= {ROOT / "docs" / "README.md", *contents}
    assert set(PAGES[1:]) <= contents | {target.resolve() for target, _ in links(README)}


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_settings_exist(page):
    groups = {field.name: getattr(pica.Settings(), field.name) for field in fields(pica.Settings)}
    groups = {name: group for name, group in groups.items() if is_dataclass(group)}
    for group, name in re.findall(rf"`({'|'.join(groups)})\.(\w+)(?=[`=])", page.read_text()):
        assert name == "slang" or hasattr(groups[group], name), f"{page.name}: {group}.{name}"
    for path, value in re.findall(r"--set (\w+\.\w+)=([\w.]+)", page.read_text()):
        pica.Settings().with_values({path: value})


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_are_commands(page):
    lines = [line for block in blocks(page, "sh") for line in block.splitlines() if line.startswith("pica ")]
    assert lines or page != README
    for line in lines:
        name, *arguments = line.split(" #")[0].split()[1:]
        get_command(app).commands[name].make_context(name, arguments)  # parses, and runs nothing


@pytest.mark.device
def test_the_readme_s_program_runs(tmp_path, monkeypatch):
    program = "".join(blocks(README, "python"))
    for whole, small in (("(640, 360)", "(32, 18)"), ("range(24)", "range(2)"), ("samples=64", "samples=1")):
        assert whole in program
        program = program.replace(whole, small)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(program, names)
    assert (tmp_path / "out.png").exists() and (tmp_path / "ids.png").exists()
    assert names["labels"].any() and names["names"] == ("background", "sign")
    assert names["frame"].display.shape == names["reference"].display.shape == (18, 32, 3)
    assert 0.5 < names["frame"].color.mean() / names["reference"].color.mean() < 1.1  # no light of many bounces


@pytest.fixture(scope="module")
def scene_made_in_docs(tmp_path_factory, device):
    """What the programs of docs/guide/scenes.md have made, the second of which changes what the first made."""
    programs = blocks(ROOT / "docs" / "guide" / "scenes.md", "python")
    (made,) = (block for block in programs if "Mesh.from_arrays(" in block)
    (changed,) = (block for block in programs if "mesh.sections = " in block)
    folder, names = tmp_path_factory.mktemp("scenes"), {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec((made + changed).replace("(320, 180)", "(32, 18)").replace("(16,", "(1,"), names)
    return folder, names


def test_the_scene_from_arrays_can_be_shown(scene_made_in_docs):
    folder, names = scene_made_in_docs
    assert (folder / "waves.png").exists()
    assert len(names["mesh"].sections[0].positions) == 65 * 65


def test_the_changed_scene_is_shown_as_a_new_one(scene_made_in_docs):
    _, names = scene_made_in_docs
    renderer, camera = names["renderer"], names["camera"]
    assert np.abs(names["after"].color - names["before"].color).mean() > 0.01
    with pica.Renderer(deepcopy(names["scene"]), size=(32, 18)) as fresh:
        expected = fresh.render(1, camera=camera).color
    np.testing.assert_allclose(renderer.render(1, camera=camera, cut=True).color, expected, rtol=1e-4, atol=1e-4)


def test_a_pass_of_one_s_own_runs(tmp_path, monkeypatch, device):
    program, *_ = blocks(ROOT / "docs" / "guide" / "own-passes.md", "python")
    for whole, small in (("(640, 360)", "(32, 18)"), ("render(16)", "render(1)")):
        assert whole in program
        program = program.replace(whole, small)
    (tmp_path / "outline.slang").write_text((ROOT / "examples" / "outline.slang").read_text())
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    assert (tmp_path / "outline.png").exists()
