"""What frames cost, as the viewer shows it."""

import xml.etree.ElementTree as ElementTree

import pytest

from pica.viewer.costs import Costs
from pica.viewer.texts import ray_lines, span

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from pica.viewer.web.cost_chart import cost_chart


@pytest.fixture
def costs():
    made = Costs()
    made.note({"g_buffer": 1.0, "shadows": 2.0, "post": 0.0})
    made.note({"g_buffer": 1.0, "shadows": 4.0})
    return made


def test_the_newest_frame_is_sorted_and_all_are_summed(costs):
    assert costs.rows == [("shadows", 4.0), ("g buffer", 1.0)] and costs.sums == [3.0, 5.0]
    assert span(costs) == "5.00 ms in all; 3.00 to 5.00 in the last 2 samples"
    for _ in range(1000):
        costs.note({"post": 1.0})
    assert len(costs.sums) < 1000, "the oldest are forgotten"


def test_bars_and_areas_are_as_long_as_the_times(costs):
    root = ElementTree.fromstring(cost_chart(costs))
    widths = [bar.get("style").split("%")[0] for bar in root.iter("span") if "background" in bar.get("style")]
    assert widths == ["width:60.0", "width:15.0"]
    below, above = (
        [tuple(map(float, point.split(","))) for point in area.get("points").split()] for area in root.iter("polygon")
    )
    assert below[:2] == [(0.0, 72.0), (320.0, 72.0)], "1 of 5 ms, of a height of 90, the g buffer"
    assert above[:2] == [(0.0, 36.0), (320.0, 0.0)], "the shadows above it, up to 3 and 5 ms"
    assert above[2:] == below[1::-1], "the areas touch"


def test_no_frame_and_odd_names_are_shown_too():
    none = Costs()
    ElementTree.fromstring(cost_chart(none))
    none.note({"<b>&": 1.0})
    assert "<b>" not in cost_chart(none)


def test_rays_are_told_most_first():
    assert ray_lines({"shadow_rays": 12, "none": 0, "indirect_rays": 3456}) == ["3,456 indirect rays", "12 shadow rays"]
