"""Histories: two sets of textures that swap, and what makes them forget."""

import pytest
import slangpy as spy

from pica.graph.plan import Plan, newest
from pica.graph.resources import Previous, Write
from tests.graph.frames import WORD, Frame, Frames, copying, filling, looking, offer, same


@pytest.fixture
def frames(device):
    return Frames(device)


def counting(frames, kind=WORD, when=None, names=("number",)):
    """A graph with a history of frames' indices; it offers that and what the frame before left. The history, and a
    list of whether that was anything, frame by frame."""
    graph, told = frames.graph(), []

    def remember(frame, known, **textures):
        told.append(known)
        filling(frame.index)(frame, **{name: textures[name] for name in names})

    with graph.scope("effect"):
        past = graph.history("past", dict.fromkeys(names, kind))
        before = graph.texture("before", kind)
        first = past[names[0]]
        graph.record("remember", remember, when=when, known=past.known, **past.swap())
        graph.record("keep", copying, source=first.previous, target=Write(before))
        offer(graph, before=before, now=first)
    return Plan(graph), past, told


def test_a_history_swaps(frames):
    plan, past, known = counting(frames)
    textures = []
    for index in range(4):
        before, now = frames.replay(plan, "before", "now")
        assert same(now, index)
        assert index == 0 or same(before, index - 1)
        textures.append(newest(past["number"]))
    assert known == [0, 1, 1, 1]
    assert textures[0] is textures[2] and textures[1] is textures[3] and textures[0] is not textures[1]


def test_all_textures_of_a_history_swap_together_and_once_a_frame(frames):
    graph = frames.graph()
    past = graph.history("past", {"mean": WORD, "mostMoments": spy.Format.rg32_uint}, layers=2)
    arguments = past.swap()
    assert set(arguments) == {"mean", "previousMean", "mostMoments", "previousMostMoments"}
    assert isinstance(arguments["mean"], Write) and isinstance(arguments["previousMean"], Previous)
    seen = []

    def look(frame, **textures):
        seen.append(textures)

    graph.record("mean", look, mean=arguments["mean"], previousMean=arguments["previousMean"])
    graph.record("moments", look, mostMoments=arguments["mostMoments"], previousMean=arguments["previousMean"])
    plan = Plan(graph)
    for _ in range(2):
        frames.replay(plan)
    assert seen[0]["previousMean"] is seen[1]["previousMean"] is seen[2]["mean"]
    assert seen[2]["previousMean"] is seen[3]["previousMean"] is seen[0]["mean"]
    assert seen[1]["mostMoments"] is not seen[3]["mostMoments"] and seen[0]["mean"].array_length == 2


def test_who_asks_before_the_writer_finds_the_frame_before_too(frames):
    graph = frames.graph()
    past, before = graph.history("past", {"number": WORD}), graph.texture("before", WORD)
    graph.record("keep", copying, source=past["number"].previous, target=Write(before))
    graph.record("remember", lambda frame, number: filling(frame.index)(frame, t=number), number=Write(past["number"]))
    offer(graph, before=before, now=past["number"])
    plan = Plan(graph)
    frames.replay(plan)
    for index in (1, 2, 3):
        before, now = frames.replay(plan, "before", "now")
        assert same(before, index - 1) and same(now, index)


def test_a_frame_that_does_not_write_it_ends_it(frames):
    plan, past, known = counting(frames, when=lambda frame: frame.index != 2)
    for _ in range(3):
        frames.replay(plan)
    assert past.state.length == 2 and same(newest(past["number"]).to_numpy(), 1)
    frames.replay(plan)
    assert known == [0, 1, 0], "what is older than the frame before is of no use"
    frames.replay(plan)
    assert known == [0, 1, 0, 1] and past.state.length == 2


def test_reset_is_by_effect(frames):
    graph = frames.graph()
    states, known = {}, {"shadows": [], "reflections": []}

    def note(told):
        return lambda frame, known, **textures: told.append(known)

    for scope, told in known.items():
        with graph.scope(scope):
            past = graph.history("past", {"number": WORD})
            states[scope] = past.state
            graph.record("remember", note(told), known=past.known, **past.swap())
    plan = Plan(graph)
    for _ in range(2):
        frames.replay(plan)
    frames.memory.reset(["reflections"])
    assert states["shadows"].length == 2 and states["reflections"].length == 0
    frames.replay(plan)
    assert known == {"shadows": [0, 1, 1], "reflections": [0, 1, 0]}
    frames.memory.reset()
    frames.replay(plan)
    assert known == {"shadows": [0, 1, 1, 0], "reflections": [0, 1, 0, 0]}


def test_equal_descriptions_survive_a_recompile(frames):
    plan, past, _ = counting(frames)
    for _ in range(3):
        frames.replay(plan)
    memory = frames.device.memory
    plan, again, known = counting(frames)
    assert again.state is past.state and frames.device.memory == memory
    before, now = frames.replay(plan, "before", "now")
    assert same(before, 2) and same(now, 3) and known == [1]


@pytest.mark.parametrize("change", [{"kind": spy.Format.rgba32_uint}, {"names": ("number", "more")}])
def test_other_descriptions_drop_it(frames, change):
    plan = counting(frames)[0]
    for _ in range(3):
        frames.replay(plan)
    plan, again, known = counting(frames, **change)
    assert again.state.length == 0
    frames.replay(plan)
    frames.replay(plan)
    assert known == [0, 1]


def test_what_no_graph_declares_any_more_is_dropped(frames):
    empty = Plan(frames.graph())
    before = frames.device.memory
    plan, past, _ = counting(frames)
    for _ in range(2):
        frames.replay(plan)
    assert frames.device.memory > before
    empty = Plan(frames.graph())
    assert frames.device.memory == before and past.state.length == 0
    frames.replay(empty)
    plan, past, known = counting(frames)
    frames.replay(plan)
    assert known == [0]


def test_histories_of_two_effects_are_two(frames):
    graph, pasts = frames.graph(), []
    for scope in ("shadows", "reflections"):
        with graph.scope(scope):
            pasts.append(graph.history("past", {"number": WORD}))
            graph.record("remember", looking, **pasts[-1].swap())
    Plan(graph)
    assert len({id(textures["number"]) for past in pasts for textures in past.state.sets}) == 4


def test_a_history_that_stays_need_not_be_written(frames):
    """Where nothing changes any more: it counts as that of the frame, as long as it is long enough."""
    kept = []
    plan, past, known = counting(frames, when=lambda frame: not kept)
    state = past.state

    def frame():
        return Frame(None, frames.index, frozenset())

    frames.replay(plan)
    assert state.precedes(frame()) and not state.stays(frame(), 2), "not long enough"
    frames.replay(plan)
    assert state.length == 2
    at = frame()
    newest_of = newest(past["number"])
    assert state.stays(at, 2) and not state.precedes(at) and state.length == 2
    kept.append(True)
    frames.replay(plan)
    assert newest(past["number"]) is newest_of
    kept.clear()
    assert state.precedes(frame()), "as if it had been written"
    frames.replay(plan)
    assert state.length == 3 and known == [0, 1, 1]
    frames.index += 1
    assert not state.precedes(frame()) and not state.stays(frame(), 1)


def test_other_sizes_drop_it(frames):
    def declare(size):
        graph = frames.graph(size)
        past = graph.history("past", {"number": WORD})
        graph.record("remember", looking, **past.swap())
        return Plan(graph), past

    plan, past = declare((64, 64))
    frames.replay(plan)
    frames.replay(plan)
    memory = frames.device.memory
    _, past = declare((512, 64))
    assert past.state.length == 0 and newest(past["number"]).width == 512 and frames.device.memory > memory
