"""What of a graph a frame records, and in which order."""

import pytest

from pica.graph.plan import Plan
from pica.graph.resources import Lifetime, write
from tests.graph.frames import SIZE, WORD, Frames, filling, looking, offer, same
from tests.tracing.kernels import kernel

FILL = """
RWTexture2D<uint> target;
uint number;
[shader("compute")] [numthreads(1, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) { target[thread.xy] = number; }
"""


@pytest.fixture
def frames(device):
    return Frames(device)


def noting(log, name):
    return lambda frame, **inputs: log.append((name, frame.index))


def test_passes_run_in_the_order_in_which_they_were_added(frames):
    graph, log = frames.graph(), []
    for name in "abc":
        graph.record(name, noting(log, name))
    plan = Plan(graph)
    assert not log, "nothing is recorded before there is a frame"
    frames.replay(plan)
    frames.replay(plan)
    assert log == [(name, index) for index in (0, 1) for name in "abc"]


def test_conditions_are_asked_in_each_frame_when_it_comes_to_their_pass(frames):
    graph, log = frames.graph(), []

    def even(frame):
        log.append(("asked", frame.index))
        return frame.index % 2 == 0

    graph.record("decide", noting(log, "decide"))
    graph.record("even", noting(log, "even"), when=even)
    plan = Plan(graph)
    assert not log
    for _ in range(3):
        frames.replay(plan)
    expected = []
    for index in range(3):
        expected += [("decide", index), ("asked", index)] + [("even", index)] * (index % 2 == 0)
    assert log == expected


def test_a_condition_holds_for_all_within_but_what_has_its_own(frames):
    graph, log = frames.graph(), []
    with graph.when(lambda frame: frame.index == 0):
        graph.record("first", noting(log, "first"))
        graph.record("own", noting(log, "own"), when=lambda frame: True)
        with graph.when(lambda frame: frame.index == 1):
            graph.record("second", noting(log, "second"))
        graph.record("first too", noting(log, "first too"))
    graph.record("always", noting(log, "always"))
    plan = Plan(graph)
    for _ in range(2):
        frames.replay(plan)
    assert log == [
        *(("first", 0), ("own", 0), ("first too", 0), ("always", 0)),
        *(("own", 1), ("second", 1), ("always", 1)),
    ]


def test_a_condition_may_follow_what_a_pass_before_decides(frames):
    graph, state = frames.graph(), {}
    texture = graph.texture("number", WORD, lifetime=Lifetime.KEPT)
    graph.record("decide", lambda frame: state.update(on=frame.index == 1))
    graph.record("fill", filling(lambda: 8), when=lambda frame: state["on"], target=write(texture))
    graph.record("clear", filling(1), when=lambda frame: not state["on"], target=write(texture))
    offer(graph, number=texture)
    plan = Plan(graph)
    assert [int(frames.replay(plan, "number")[0, 0]) for _ in range(3)] == [1, 8, 1]


def test_threads_and_values_may_follow_the_frame(frames):
    graph = frames.graph()
    texture = graph.texture("number", WORD, lifetime=Lifetime.KEPT)
    graph.clear(texture)
    step = kernel(frames.device, FILL)
    width = lambda frame: (frame.index + 1, SIZE[1], 1)  # noqa: E731
    graph.add(step, width, target=write(texture), number=lambda frame: frame.index + 5)
    offer(graph, number=texture)
    plan = Plan(graph)
    for index in range(3):
        found = frames.replay(plan, "number")
        assert same(found[:, : index + 1], index + 5) and same(found[:, index + 1 :], 0)


def test_only_one_effect_s_passes(frames):
    graph, log = frames.graph(), []
    for scope in ("gbuffer", "shadows", "gbuffer"):
        with graph.scope(scope):
            graph.record("pass", noting(log, scope))
    with graph.scope("gbuffer"):
        texture = graph.texture("number", WORD)
        graph.record("fill", filling(6), target=write(texture))
        offer(graph, number=texture)
    plan = Plan(graph)
    assert same(frames.replay(plan, "number", only="gbuffer"), 6)
    assert log == [("gbuffer", 0), ("gbuffer", 0)]


def test_nothing_is_captured_that_nobody_asks_for(frames):
    graph, read = frames.graph(), []
    texture = graph.texture("number", WORD)
    graph.record("fill", filling(6), target=write(texture))
    graph.offer("number", (texture,), lambda values: read.append(values.shape) or values.max())
    plan = Plan(graph)
    frames.replay(plan)
    assert not read
    assert frames.replay(plan, "number") == 6
    assert read == [(SIZE[1], SIZE[0])]


def test_passes_for_what_nobody_asks_for_are_left_out_until_somebody_does(frames):
    """Who asks has the frame declared anew."""

    def declare(*requested):
        graph = frames.graph(requested=requested)
        if graph.wants("number", "other"):
            texture = graph.texture("number", WORD)
            graph.record("fill", filling(6), target=write(texture))
            offer(graph, number=texture)
        graph.record("look", looking)
        return Plan(graph)

    plan = declare()
    assert [node.name for node in plan.nodes] == ["look"] and {"number", "other"} <= plan.offers.keys()
    assert plan.lacks({"number"}) == {"number"} and plan.lacks({"elsewhere"}) == plan.lacks(()) == set()
    assert plan.names("frame", None) == set() and plan.names("frame", {"number"}) == {"number"}
    plan = declare("other")
    assert [node.name for node in plan.nodes] == ["fill", "look"]
    assert plan.lacks({"number"}) == set() and same(frames.replay(plan, "number"), 6)
    assert plan.names("frame", None) == set(), "who wants all does not want what takes passes of its own"


def test_an_offer_may_look_at_the_frame_and_at_several_resources(frames):
    graph = frames.graph()
    one, two = graph.texture("one", WORD), graph.texture("two", WORD)
    buffer = graph.buffer("zeros", 16)
    graph.record("fill", filling(2), one=write(one))
    graph.record("fill", filling(3), two=write(two))
    graph.clear(buffer)
    sources = one, two, buffer

    def prepare(frame):
        index = frame.index
        return lambda one, two, zeros: (index, int(one.max()), int(two.max()), zeros.shape, int(zeros.max()))

    graph.offer("all", sources, prepare=prepare)
    plan = Plan(graph)
    frames.replay(plan)
    assert frames.replay(plan, "all") == (1, 2, 3, (16,), 0)


def test_an_offer_without_sources_is_read_when_it_is_fetched(frames):
    graph = frames.graph()
    graph.record("look", looking)
    graph.offer("count", (), lambda: 42)
    assert frames.replay(Plan(graph), "count") == 42


def test_names_of_offers(frames):
    graph = frames.graph()
    texture = graph.texture("number", WORD)
    graph.record("fill", filling(6), target=write(texture))
    for scope, names in (
        ("gbuffer", ("depth", "uv")),
        ("shadows", ("shadows", "debug.shadows.raw", "rays.shadow_rays")),
    ):
        with graph.scope(scope):
            for name in names:
                graph.offer(name, (texture,), lambda values: values, on_request=name in ("uv", "rays.shadow_rays"))
    with graph.scope("shadows"):
        assert not graph.wants("debug.shadows.past")
    offer(graph, color=texture, display=texture)
    plan = Plan(graph)
    assert plan.names("gbuffer", None) == {"depth"} and plan.names("gbuffer", {"uv", "shadows"}) == {"uv"}
    assert plan.names_but("gbuffer", None, debug=False) == {"shadows"}
    assert plan.names_but("gbuffer", None, debug=True) == {"shadows", "debug.shadows.raw", "debug.shadows.past"}
    assert plan.names_but("gbuffer", {"debug.shadows.raw", "depth"}, debug=False) == {"debug.shadows.raw"}
    assert plan.names_of("rays") == {"rays.shadow_rays"}


def test_clear_empties_textures_and_buffers(frames):
    graph = frames.graph()
    texture, buffer = graph.texture("number", WORD), graph.buffer("bytes", 32, lifetime=Lifetime.FRAME)
    graph.clear(texture)
    graph.clear(buffer)
    offer(graph, number=texture, bytes=buffer)
    plan = Plan(graph)
    numbers, held = frames.replay(plan, "number", "bytes")
    assert same(numbers, 0) and same(held, 0) and held.shape == (32,)


def test_sizes(frames):
    graph = frames.graph((7, 5))
    assert graph.half_size == (4, 3) and graph.half_grid == (4, 3, 1) and graph.grid == graph.output_grid == (7, 5, 1)
    texture, half = graph.texture("whole", WORD), graph.texture("half", WORD, graph.half_size)
    graph.record("fill", filling(1), whole=write(texture), half=write(half))
    Plan(graph)
    assert (texture.physical.width, texture.physical.height) == (7, 5)
    assert (half.physical.width, half.physical.height) == (4, 3)
