"""Parameter blocks whose fields follow the frame."""

from dataclasses import dataclass

import numpy as np
import pytest
import slangpy as spy

from pica.graph.plan import Plan
from pica.graph.resources import Block, write
from tests.graph.frames import SIZE, WORD, Frames, filling, offer, same
from tests.tracing.kernels import kernel

MODULE = """
struct Seen { Texture2D<uint> values; uint more; };
ParameterBlock<Seen> seen;
"""
PAIR = """
struct Pair { Texture2D<uint> values; Texture2D<uint> previousValues; };
ParameterBlock<Pair> pair;
"""
ADD = """
import tests_seen;
RWTexture2D<uint> sum;
[shader("compute")] [numthreads(8, 8, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    uint2 size;
    sum.GetDimensions(size.x, size.y);
    if (all(thread.xy < size))
        sum[thread.xy] = seen.values[thread.xy] + seen.more;
}
"""
DIFFERENCE = """
import tests_pair;
RWTexture2D<uint> difference;
[shader("compute")] [numthreads(8, 8, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    uint2 size;
    difference.GetDimensions(size.x, size.y);
    if (all(thread.xy < size))
        difference[thread.xy] = 100 * pair.values[thread.xy] + pair.previousValues[thread.xy];
}
"""


@dataclass
class Holder:
    """Stands for a G-buffer: what passes are given that has a block."""

    block: Block


def block_of(graph, values, more=0):
    """A block over a texture, as passes are given it."""
    graph.device.handle.load_module_from_source("tests_seen", MODULE)
    return Holder(graph.block("tests_seen", "seen", values=values, more=more))


@pytest.fixture
def frames(device):
    return Frames(device)


def add(graph, block):
    total = graph.texture("sum", WORD)
    graph.add(kernel(graph.device, ADD), (*SIZE, 1), seen=block, sum=write(total))
    offer(graph, sum=total)
    return total


@pytest.mark.parametrize("itself", [False, True])
def test_passes_read_a_block_s_fields(frames, itself):
    """Whether they are given what has it or the block itself."""
    graph = frames.graph()
    values = graph.texture("values", WORD)
    graph.record("fill", filling(5), values=write(values))
    holder = block_of(graph, values, more=2)
    add(graph, holder.block if itself else holder)
    assert same(frames.replay(Plan(graph), "sum"), 7)


def test_functions_are_asked_in_each_frame(frames):
    graph = frames.graph()
    values = graph.texture("values", WORD)
    graph.record("fill", filling(5), values=write(values))
    add(graph, block_of(graph, values, more=lambda frame: 10 * frame.index))
    plan = Plan(graph)
    assert [int(frames.replay(plan, "sum")[0, 0]) for _ in range(3)] == [5, 15, 25]


def test_what_a_block_has_is_in_use_until_the_last_pass_that_is_given_it(frames):
    graph = frames.graph()
    values, other = graph.texture("values", WORD), graph.texture("other", WORD)
    graph.record("fill", filling(5), values=write(values))
    holder = block_of(graph, values)
    graph.record("fill another", filling(9), values=write(other))
    add(graph, holder)
    assert same(frames.replay(Plan(graph), "sum"), 5)
    assert values.physical is not other.physical


def test_blocks_follow_histories(frames):
    graph = frames.graph()
    past = graph.history("past", {"values": WORD})
    graph.record("remember", lambda frame, **now: filling(frame.index)(frame, **now), values=write(past["values"]))
    graph.device.handle.load_module_from_source("tests_pair", PAIR)
    pair = graph.block("tests_pair", "pair", values=past["values"], previousValues=past["values"].previous)
    difference = graph.texture("difference", WORD)
    shader = kernel(graph.device, DIFFERENCE)
    graph.add(shader, (*SIZE, 1), pair=Holder(pair), difference=write(difference))
    offer(graph, difference=difference)
    plan = Plan(graph)
    frames.replay(plan)
    assert [int(frames.replay(plan, "difference")[0, 0]) for _ in range(3)] == [100, 201, 302]


def test_a_block_is_one_for_each_effect_and_outlives_a_graph(frames):
    blocks = []
    for _ in range(2):
        graph = frames.graph()
        for scope in ("shadows", "reflections"):
            with graph.scope(scope):
                values = graph.texture("values", WORD)
                graph.record("fill", filling(len(blocks)), values=write(values))
                holder = block_of(graph, values)
                add(graph, holder)
            blocks.append(holder.block.parameters)
        Plan(graph)
    assert blocks[0] is blocks[2] and blocks[1] is blocks[3] and blocks[0] is not blocks[1]


def test_a_block_without_a_field_is_an_error(frames):
    from pica.errors import BindingError

    graph = frames.graph()
    values = graph.texture("values", WORD)
    graph.record("fill", filling(5), values=write(values))
    graph.device.handle.load_module_from_source("tests_seen", MODULE)
    add(graph, Holder(graph.block("tests_seen", "seen", values=values)))
    with pytest.raises(BindingError, match="not bound: more"):
        frames.replay(Plan(graph))


def test_arrays_of_structs_and_plain_values_pass_through(frames):
    """Whatever is no resource is bound as it is."""
    graph = frames.graph()
    seen = []
    size, rows = spy.uint2(3, 4), np.ones(3)
    graph.record("look", lambda frame, **values: seen.append(values), size=size, rows=rows, none=None)
    frames.replay(Plan(graph))
    assert seen[0]["size"] is size and seen[0]["rows"] is rows and seen[0]["none"] is None


class Step:
    """A pass whose shader has a block, and what it was given."""

    blocks = frozenset({"seen"})

    def __call__(self, frame, threads, **values):
        self.values = values


def test_blocks_are_given_to_passes_that_have_them(device):
    frames = Frames(device)
    graph, steps = frames.graph(), [Step() for _ in range(4)]
    graph.add(steps[0], (1, 1, 1))
    graph.provide(seen=1, other=2)
    graph.add(steps[1], (1, 1, 1))
    with graph.scope("effect"):
        graph.provide(seen=3)
        graph.add(steps[2], (1, 1, 1), seen=4)
    graph.add(steps[3], (1, 1, 1), more=5)
    frames.replay(Plan(graph))
    assert [step.values for step in steps] == [{}, {"seen": 1}, {"seen": 4}, {"seen": 1, "more": 5}]
