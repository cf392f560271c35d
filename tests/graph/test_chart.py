"""The chart of a graph, whatever its names are."""

from xml.etree import ElementTree

import pytest

from pica.errors import PicaError
from pica.graph.description import GraphDescription, PassInfo, ResourceInfo

SVG = "{http://www.w3.org/2000/svg}"
ODD = 'a<b>&"c"\x1b'


def described(count):
    """Passes that each write a resource and read the one before; three of them have one memory."""
    keys = [f"{ODD}/{ODD} {number}" for number in range(count)]
    passes = [
        PassInfo(f"{ODD} {n}", ODD, "file.py:1", tuple(keys[n - 1 : n]), (), (keys[n],), n == 1, 0.5 * n)
        for n in range(count)
    ]
    resources = []
    for n in range(count):
        kind = "r32_float", (8, 4), None, 128, "frame"
        resources.append(ResourceInfo(f"{ODD} {n}", ODD, "file.py:2", *kind, n, min(n + 1, count - 1), n % 3))
    return GraphDescription(tuple(passes), tuple(resources), {ODD: 384})


@pytest.mark.parametrize("count", [0, 1, 7, 60])
def test_it_is_xml_within_its_size(count, tmp_path):
    described(count).save(tmp_path / "chart.svg", f"the title {ODD}")
    root = ElementTree.parse(tmp_path / "chart.svg").getroot()
    texts = [text.text for text in root.iter(f"{SVG}text")]
    assert texts[0].startswith('the title a<b>&"c"')
    assert sum(text.startswith('a<b>&"c"') for text in texts) >= 2 * count
    width, height = (float(root.get(name)) for name in ("width", "height"))
    boxes = [box for box in root.iter(f"{SVG}rect") if box.get("x")]
    assert all(float(box.get("x")) + float(box.get("width")) <= width for box in boxes)
    assert all(float(text.get("y", 0)) <= height for text in root.iter(f"{SVG}text"))
    frames = [box for box in boxes if box.get("rx") == "4"]
    assert len(frames) == (3 if count > 5 else 0), "resources of one memory stand in one frame"


def test_sums_and_neighbours_in_memory():
    graph = described(7)
    assert graph.milliseconds == {ODD: 0.5 * 21}
    assert [each.first for each in graph.sharing(graph.resources[1])] == [4]
    assert graph.as_dict()["passes"][2]["reads"] == (f"{ODD}/{ODD} 1",)


def test_another_suffix_is_an_error(tmp_path):
    with pytest.raises(PicaError, match=r"must end in \.svg"):
        described(1).save(tmp_path / "chart.png")
