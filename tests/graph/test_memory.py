"""What shares memory, what keeps it, and what of it is given back."""

import gc
import weakref
from itertools import pairwise

import numpy as np
import pytest
import slangpy as spy

from pica.graph.plan import Plan
from pica.graph.resources import Lifetime, update, write
from tests.graph.frames import SIZE, WORD, Frame, Frames, copying, filling, looking, offer, same


@pytest.fixture
def frames(device):
    return Frames(device)


def chain(graph, count, **more):
    """Textures of which each is made from the one before."""
    textures = [graph.texture(f"step {number}", WORD, **more) for number in range(count)]
    graph.record("fill", filling(7), target=write(textures[0]))
    for source, target in pairwise(textures):
        graph.record("copy", copying, source=source, target=write(target))
    return textures


def test_textures_that_live_one_after_the_other_share_memory(frames):
    graph = frames.graph()
    steps = chain(graph, 6)
    offer(graph, last=steps[-1])
    plan = Plan(graph)
    assert same(frames.replay(plan, "last"), 7)
    assert len({id(step.physical) for step in steps}) == 2, "no more than are in use at once"
    for source, target in pairwise(steps):
        assert source.physical is not target.physical


def test_textures_in_use_at_once_do_not(frames):
    graph = frames.graph()
    several = [graph.texture(f"light {number}", WORD) for number in range(4)]
    for number, texture in enumerate(several):
        graph.record("fill", filling(number + 1), target=write(texture))
    graph.record("add up", looking, **{f"light{number}": texture for number, texture in enumerate(several)})
    for number, texture in enumerate(several):
        offer(graph, **{f"light {number}": texture})
    found = frames.replay(Plan(graph), *(f"light {number}" for number in range(4)))
    assert [int(array[0, 0]) for array in found] == [1, 2, 3, 4]
    assert len({id(texture.physical) for texture in several}) == 4


def test_what_is_updated_later_is_in_use_till_then(frames):
    graph = frames.graph()
    first, second = graph.texture("first", WORD), graph.texture("second", WORD)
    graph.record("fill", filling(1), target=write(first))
    graph.record("fill another", filling(2), target=write(second))
    graph.record("update", looking, target=update(first))
    Plan(graph)
    assert first.physical is not second.physical


def test_only_like_shares_with_like(frames):
    graph = frames.graph()
    kinds = [
        {"texture_format": WORD},
        {"texture_format": spy.Format.rgba16_float},
        {"texture_format": WORD, "size": (3, 2)},
        {"texture_format": WORD, "layers": 1},
        {"texture_format": WORD, "layers": 2},
    ]
    textures = [graph.texture(f"kind {number}", **kind) for number, kind in enumerate(kinds)]
    for texture in textures:
        graph.record("fill", looking, target=write(texture))
    Plan(graph)
    assert len({id(texture.physical) for texture in textures}) == len(kinds)
    assert (textures[2].physical.width, textures[2].physical.height) == (3, 2)
    assert textures[4].physical.array_length == 2


def test_buffers_share_too(frames):
    graph = frames.graph()
    first, second = (graph.buffer(name, 64, lifetime=Lifetime.FRAME) for name in ("first", "second"))
    kept = graph.buffer("kept", 64)
    for buffer in (first, second, kept):
        graph.clear(buffer)
    Plan(graph)
    assert first.physical is second.physical is not kept.physical


def test_what_is_kept_shares_with_nobody_and_keeps_its_content(frames):
    graph = frames.graph()
    kept = graph.texture("kept", WORD, lifetime=Lifetime.KEPT)
    offer(graph, before=kept)
    graph.record("fill once", filling(5), when=lambda frame: frame.index == 0, target=write(kept))
    steps = chain(graph, 3)
    offer(graph, kept=kept)
    plan = Plan(graph)
    assert same(frames.replay(plan, "kept"), 5)
    assert same(frames.replay(plan, "kept"), 5)
    assert kept.physical not in [step.physical for step in steps]


def test_what_is_written_under_a_condition_shares_with_nobody(frames):
    """Who reads it in a frame that leaves its writer out still finds it."""
    graph = frames.graph()
    sometimes = graph.texture("sometimes", WORD)
    graph.record("fill", filling(3), when=lambda frame: frame.index == 0, target=write(sometimes))
    shown = graph.texture("shown", WORD)
    graph.record("show", copying, source=sometimes, target=write(shown))
    offer(graph, shown=shown)
    chain(graph, 4)
    plan = Plan(graph)
    for _ in range(3):
        assert same(frames.replay(plan, "shown"), 3)
    others = [each.physical for each in plan.resources if each is not sometimes]
    assert sometimes.physical not in others


def test_what_only_passes_of_one_condition_use_shares(frames):
    """They run together or not at all."""

    def seldom(frame):
        return frame.index == 1

    graph = frames.graph()
    with graph.when(seldom):
        within, after = chain(graph, 2)
    other = graph.texture("other", WORD)
    graph.record("fill", filling(1), target=write(other))
    Plan(graph)
    assert within.physical is not after.physical and other.physical in (within.physical, after.physical)


def test_an_offer_is_taken_before_the_memory_is_another_s(frames):
    graph = frames.graph()
    steps = chain(graph, 2)
    offer(graph, early=steps[0])
    late = graph.texture("late", WORD)
    graph.record("fill", filling(9), target=write(late))
    offer(graph, late=late)
    plan = Plan(graph)
    early, last = frames.replay(plan, "early", "late")
    assert same(early, 7) and same(last, 9)
    assert late.physical in [step.physical for step in steps]


def test_what_is_offered_later_is_in_use_till_then(frames):
    graph = frames.graph()
    first = graph.texture("first", WORD)
    graph.record("fill", filling(1), target=write(first))
    second = graph.texture("second", WORD)
    graph.record("fill", filling(2), target=write(second))
    offer(graph, first=first)
    found = frames.replay(Plan(graph), "first")
    assert same(found, 1) and first.physical is not second.physical


def test_a_snapshot_stays_as_it_was(frames):
    number = iter(range(10, 20))
    graph = frames.graph()
    texture = graph.texture("number", WORD)
    graph.record("fill", filling(lambda: next(number)), target=write(texture))
    offer(graph, number=texture)
    plan = Plan(graph)
    with frames.device.record() as recording:
        found = plan.replay(Frame(recording, 0, frozenset({"number"})))["number"]
    frames.index = 1
    assert same(frames.replay(plan, "number"), 11)
    assert same(found(), 10)


def test_nothing_is_one_texel_that_all_share(frames):
    graph = frames.graph()
    with graph.scope("shadows"):
        nothing = graph.nothing(WORD)
    with graph.scope("reflections"):
        assert graph.nothing(WORD) is nothing
        layered = graph.nothing(WORD, layers=1)
    assert layered is not nothing and layered is graph.nothing(WORD, 1)
    assert graph.nothing(spy.Format.rgba16_float) not in (nothing, layered)
    graph.record("look", looking, nothing=nothing, layered=layered)
    Plan(graph)  # though nobody writes it
    assert (nothing.physical.width, nothing.physical.height) == (1, 1)
    assert layered.physical.type == spy.TextureType.texture_2d_array
    assert "nothing" in frames.memory.bytes and frames.memory.bytes["nothing"] > 0


def test_recompiling_keeps_what_is_kept_under_the_same_name_and_description(frames):
    def declare(**kinds):
        graph = frames.graph()
        kept = {name: graph.texture(name, kind, lifetime=Lifetime.KEPT) for name, kind in kinds.items()}
        for name, texture in kept.items():
            graph.record("fill", filling(4), when=lambda frame: frame.index == 0, target=write(texture))
            offer(graph, **{name: texture})
        return Plan(graph), {name: texture.physical for name, texture in kept.items()}

    plan, before = declare(stays=WORD, changes=WORD, goes=WORD)
    frames.replay(plan, "stays", "changes", "goes")
    memory = frames.device.memory
    plan, after = declare(stays=WORD, changes=spy.Format.rgba32_uint)
    assert after["stays"] is before["stays"] and after["changes"] is not before["changes"]
    assert same(frames.replay(plan, "stays"), 4)
    size = before["goes"].memory_usage.device
    assert frames.device.memory == memory - 2 * size + after["changes"].memory_usage.device


def test_buffers_begin_with_their_data_and_keep_what_passes_made_of_it(frames):
    def declare():
        graph = frames.graph()
        ones = graph.buffer("ones", data=np.ones(4, np.uint32))
        offer(graph, before=ones)
        graph.record("look", looking, ones=ones)
        graph.clear(ones, when=lambda frame: frame.index == 1)
        offer(graph, after=ones)
        return Plan(graph)

    plan = declare()
    assert same(frames.replay(plan, "after").view(np.uint32), 1)
    assert same(frames.replay(plan, "after"), 0)
    assert same(frames.replay(declare(), "after"), 0)


def test_memory_follows_the_graph_and_is_told_by_effect(frames):
    def declare(steps, large=False):
        graph = frames.graph((64, 64) if large else SIZE)
        with graph.scope("shadows"):
            chain(graph, steps)
            kept = graph.texture("kept", WORD, lifetime=Lifetime.KEPT)
            past = graph.history("past", {"mean": WORD})
            graph.record("fill", looking, target=write(kept), **past.swap())
        return Plan(graph)

    before = frames.device.memory
    declare(2)
    small, told = frames.device.memory, dict(frames.memory.bytes)
    assert set(told) == {"shadows", "shared"} and sum(told.values()) == small - before
    declare(2, large=True)
    assert frames.device.memory > small
    declare(2)
    assert frames.device.memory == small and frames.memory.bytes == told
    Plan(frames.graph())
    assert frames.device.memory == before and frames.memory.bytes == {}


def test_a_plan_is_no_circle(frames):
    """What is dropped is gone at once, with all that it has on the device."""
    gc.collect()
    gc.disable()
    try:
        graph = frames.graph()
        past = graph.history("past", {"mean": WORD})
        graph.record("fill", looking, **past.swap())
        steps = chain(graph, 3)
        plan = Plan(graph)
        gone = [weakref.ref(each) for each in (plan, graph, graph.nodes[0], past, steps[0])]
        del plan, graph, past, steps
        assert not any(each() for each in gone)
    finally:
        gc.enable()
