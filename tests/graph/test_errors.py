"""Frames that cannot be: each is one line with both passes, and where they and the resource were declared."""

import sys

import pytest
import slangpy as spy

from pica.errors import GraphError
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan
from pica.graph.resources import Lifetime, update, write
from tests.graph.frames import SIZE, WORD, looking


@pytest.fixture
def graph() -> FrameGraph:
    """None of these takes any memory."""
    return FrameGraph(Memory(None), SIZE, SIZE)


def here() -> str:
    """The line that calls this, as messages have it."""
    return f"graph/test_errors.py:{sys._getframe(1).f_lineno}"


def fault(call, *arguments) -> str:
    with pytest.raises(GraphError) as raised:
        call(*arguments)
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_a_read_that_nobody_writes(graph):
    with graph.scope("lighting"):
        light, at = graph.texture("light", WORD), here()
    with graph.scope("post"):
        _, reader = graph.record("tone map", looking, light=light), here()
    told = f"pass 'tone map' of post ({reader}) reads lighting 'light' (declared at {at}), which no pass writes"
    assert fault(Plan, graph) == told


def test_two_writers(graph):
    light, at = graph.texture("light", WORD), here()
    with graph.scope("lighting"):
        _, first = graph.record("direct", looking, light=write(light)), here()
    lines = []

    def again():
        with graph.scope("reflections"):
            lines.append(here()), graph.record("mirror", looking, light=write(light))

    message = fault(again)
    assert f"pass 'mirror' of reflections ({lines[0]}) writes frame 'light' (declared at {at})" in message
    assert f"pass 'direct' of lighting ({first}) has written; use update(...)" in message


def test_a_writer_after_one_that_updates(graph):
    light = graph.texture("light", WORD)
    graph.record("adds", looking, light=update(light))
    message = fault(lambda: graph.record("fills", looking, light=write(light)))
    assert "pass 'fills'" in message and "pass 'adds'" in message


def test_two_writers_of_which_one_is_for_every_frame(graph):
    light = graph.texture("light", WORD)
    graph.record("always", looking, light=write(light))
    message = fault(lambda: graph.record("sometimes", looking, when=lambda frame: True, light=write(light)))
    assert "pass 'always'" in message and "pass 'sometimes'" in message


def test_alternatives_may_write_the_same(graph):
    light = graph.texture("light", WORD)
    for name in ("still", "moving"):
        graph.record(name, looking, when=lambda frame: True, light=write(light))


def test_a_read_before_the_write(graph):
    light, at = graph.texture("light", WORD), here()
    _, reader = graph.record("shows", looking, light=light), here()
    _, writer = graph.record("fills", looking, light=write(light)), here()
    told = (
        f"pass 'shows' of frame ({reader}) reads frame 'light' (declared at {at}) before "
        f"pass 'fills' of frame ({writer}) writes it: a cycle, or passes in the wrong order"
    )
    assert fault(Plan, graph) == told


def test_a_cycle(graph):
    a, b = graph.texture("a", WORD), graph.texture("b", WORD)
    graph.record("one", looking, source=b, target=write(a))
    graph.record("other", looking, source=a, target=write(b))
    message = fault(Plan, graph)
    assert "pass 'one'" in message and "pass 'other'" in message and "a cycle" in message


def test_an_update_of_what_nobody_wrote(graph):
    light, at = graph.texture("light", WORD), here()
    _, updater = graph.record("adds", looking, light=update(light)), here()
    told = f"pass 'adds' of frame ({updater}) updates frame 'light' (declared at {at}), which no pass before it writes"
    assert fault(Plan, graph) == told


def test_what_a_pass_reads_and_fills_anew_at_once(graph):
    light = graph.texture("light", WORD)
    graph.record("blurs", looking, source=light, target=write(light))
    assert "pass 'blurs'" in fault(Plan, graph)


def test_the_newest_of_a_history_is_read_before_it_is_written(graph):
    past = graph.history("past", {"mean": WORD})
    _, reader = graph.record("shows", looking, mean=past["mean"]), here()
    _, writer = graph.record("remembers", looking, **past.swap()), here()
    message = fault(Plan, graph)
    assert f"pass 'shows' of frame ({reader}) reads frame 'past mean'" in message
    assert f"pass 'remembers' of frame ({writer})" in message


def test_a_block_s_fields_are_read_by_the_passes_that_are_given_it(device):
    from tests.graph.test_blocks import block_of

    graph = FrameGraph(Memory(device), SIZE, SIZE)
    values = graph.texture("values", WORD)
    block = block_of(graph, values)
    graph.record("fills", looking, values=write(values))
    graph.record("shows", looking, block=block)
    Plan(graph)
    unwritten = graph.texture("unwritten", WORD)
    graph.record("shows more", looking, block=block_of(graph, unwritten))
    message = fault(Plan, graph)
    assert "pass 'shows more'" in message and "frame 'unwritten'" in message and "no pass writes" in message


@pytest.mark.parametrize("declare", ["texture", "buffer", "history"])
def test_a_name_declared_twice(graph, declare):
    def declared():
        if declare == "texture":
            graph.texture("light", WORD)
        elif declare == "buffer":
            graph.buffer("light", 16)
        else:
            graph.history("past", {"light": WORD})

    name = "past light" if declare == "history" else "light"
    with graph.scope("lighting"):
        declared()
        message = fault(declared)
    assert message.startswith(f"lighting declares '{name}' twice, at graph/test_errors.py:")
    with graph.scope("reflections"):
        declared()


def test_both_places_of_a_name_declared_twice(graph):
    _, first = graph.texture("light", WORD), here()
    lines = []

    def again():
        lines.append(here()), graph.buffer("light", 16)

    assert fault(again) == f"frame declares 'light' twice, at {first} and at {lines[0]}"


def test_a_place_is_where_the_effect_calls_the_graph(graph):
    """Not in the graph's own files: whichever of its functions adds the pass."""
    light, at = graph.texture("light", WORD), here()
    assert light.where == at
    _, cleared = graph.clear(light), here()
    assert graph.nodes[-1].where == cleared
    past, at = graph.history("past", {"mean": WORD}), here()
    assert past["mean"].where == at
    nothing, at = graph.nothing(spy.Format.rgba32_float), here()
    assert nothing.where == at


def test_what_is_kept_may_be_read_before_it_is_written(device):
    """It is there from the frame before; and any number of passes may fill it anew."""
    graph = FrameGraph(Memory(device), SIZE, SIZE)
    light = graph.texture("light", WORD, lifetime=Lifetime.KEPT)
    graph.record("shows", looking, light=light)
    graph.record("adds", looking, light=update(light))
    graph.record("fills", looking, light=write(light))
    graph.record("fills again", looking, light=write(light))
    Plan(graph)
