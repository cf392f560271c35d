"""Settings take only what they can hold, by any name."""

from dataclasses import fields

from hypothesis import given
from hypothesis import strategies as st

import pica
from pica.settings import Settings
from tests.fuzz.mutations import hostile
from tests.fuzz.outcome import held

GROUPS = [field.name for field in fields(Settings)]
PATHS = list(Settings.schema()["settings"])
paths = st.sampled_from(PATHS) | st.sampled_from(GROUPS) | st.text(max_size=12) | st.just("seed.seed")
values = hostile | st.sampled_from(["low", "high", "0", "1e400", "-1", "true", "2.5", " 1", "0x10", "1_000", "٣"])


@given(st.dictionaries(paths, values, max_size=4))
def test_values_by_name(given_values):
    with held():
        settings = Settings().with_values(given_values)
        assert Settings().with_values({path: _value(settings, path) for path in PATHS}) == settings


@given(hostile)
def test_presets(name):
    with held():
        Settings.preset(name)


@given(st.sampled_from(GROUPS), st.data())
def test_groups(name, data):
    group = type(getattr(Settings(), name))
    if group is int:
        return
    names = st.sampled_from([field.name for field in fields(group)])
    with held():
        Settings(**{name: group(**data.draw(st.dictionaries(names, values, max_size=2)))})


def _value(settings: pica.Settings, path: str) -> object:
    for name in path.split("."):
        settings = getattr(settings, name)
    return settings
