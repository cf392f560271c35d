import json
import re
from itertools import pairwise
from xml.etree import ElementTree

import pytest

SVG = "{http://www.w3.org/2000/svg}"
SMALL = "--size", "32x18", "--preset", "raster"


@pytest.fixture(scope="module")
def picture(device, tmp_path_factory):
    """The chart of a frame, and the text of its names."""
    from pica.cli.main import main

    path = tmp_path_factory.mktemp("graph") / "graph.svg"
    assert main(["graph", "cornell", "-o", str(path), *SMALL]) == 0
    root = ElementTree.parse(path).getroot()
    return root, [text.text or "" for text in root.iter(f"{SVG}text")]


def test_the_chart_is_xml_that_names_passes_resources_times_and_memory(picture):
    root, texts = picture
    assert root.tag == f"{SVG}svg" and texts[0].startswith("cornell, raster, 32x18, ")
    assert {"gbuffer", "shadow map lookup", "temporal_resolve", "tone_map", "radiance", "reprojection found"} <= set(
        texts
    )
    assert any(text.endswith(" kB") for text in texts) and any(
        re.fullmatch(r"post: \d+\.\d\d ms, .* kB", text) for text in texts
    )


def test_all_of_it_lies_within_the_picture(picture):
    root, _ = picture
    width, height = (float(root.get(name)) for name in ("width", "height"))
    placed = [box for box in root.iter(f"{SVG}rect") if box.get("x")]
    boxes = [[float(box.get(name)) for name in ("x", "y", "width", "height")] for box in placed]
    assert len(boxes) > 100
    assert all(x >= 0 and y >= 0 and x + w <= width and y + h <= height for x, y, w, h in boxes)
    assert all(0 <= float(text.get("y", 0)) <= height for text in root.iter(f"{SVG}text"))


def test_json_is_the_graph_alone_on_stdout(device, run):
    code, out, err = run("graph", "cornell", "--json", *SMALL)
    found = json.loads(out)
    assert code == 0 and '"progress": "Rendering"' in err
    keys = {f"{each['effect']}/{each['name']}" for each in found["resources"]}
    for each in found["passes"]:
        assert {*each["reads"], *each["writes"], *each["previous"]} <= keys
    times = [each["milliseconds"] or 0 for each in found["passes"]]
    assert sum(times) == pytest.approx(sum(found["milliseconds"].values())) and sum(times) > 0
    # What shares memory is never in use at once, and is counted once.
    lanes = {}
    for each in found["resources"]:
        lanes.setdefault(each["lane"], []).append(each)
    shared = [lane for lane in lanes.values() if len(lane) > 1]
    assert shared
    for lane in shared:
        spans = sorted((each["first"], each["last"]) for each in lane)
        assert all(last < first for (_, last), (first, _) in pairwise(spans))
        assert {each["lifetime"] for each in lane} == {"frame"}
    assert sum(max(each["bytes"] for each in lane) for lane in lanes.values()) == sum(found["memory"].values())


def test_without_a_file_there_is_a_table(device, run):
    code, out, _ = run("graph", "cornell", *SMALL)
    rows = [line.split() for line in out.splitlines()]
    assert code == 0 and ["effect", "pass", "ms", "reads", "writes"] in rows
    (row,) = (row for row in rows if row[:2] == ["lighting", "lighting"])
    written = row[-2:]
    assert (
        float(row[2]) > 0
        and "gbuffer/*," in row
        and written == ["stochastic_light/samples,", "stochastic_light/albedo"]
    )
    (total,) = (row for row in rows if row[:1] == ["all"])
    assert float(total[1]) > 0 and float(total[2]) > 0


def test_the_file_is_an_svg(run, calls):
    code, _, err = run("graph", "m.glb", "-o", "graph.png")
    assert code == 2 and err == "pica: cannot write graph.png: the name must end in .svg\n"
