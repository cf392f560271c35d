"""Changes by hand, and their undoing."""

import pytest

import pica
from pica.viewer.edits import Edits


@pytest.fixture
def material() -> pica.Material:
    return pica.Material(roughness=0.5)


def test_steps_are_undone_and_redone_in_order(material):
    edits = Edits()
    edits.apply([(material, "roughness", 0.1)], 0.0)
    edits.apply([(material, "metallic", 0.0)], 0.1)
    edits.apply([(material, "roughness", 0.2)], 0.2)
    edits.undo()
    assert (material.roughness, material.metallic) == (0.1, 0.0)
    edits.undo()
    edits.undo()
    edits.undo()
    assert (material.roughness, material.metallic, edits.can_undo, edits.can_redo) == (0.5, 1.0, False, True)
    edits.redo()
    edits.redo()
    assert (material.roughness, material.metallic) == (0.1, 0.0)
    edits.apply([(material, "roughness", 0.9)], 0.3)
    assert not edits.can_redo
    edits.undo()
    assert material.roughness == 0.1, "what comes after an undo is a step of its own"


def test_a_drag_is_one_step(material):
    edits = Edits()
    for number in range(20):
        edits.apply([(material, "roughness", number / 20)], number * 0.5)
    edits.apply([(material, "roughness", 1.0)], 20.0)
    edits.undo()
    assert material.roughness == 0.95, "after a pause another one begins"
    edits.undo()
    assert material.roughness == 0.5 and not edits.can_undo
    edits.redo()
    assert material.roughness == 0.95


def test_what_is_refused_changes_nothing(material):
    edits = Edits()
    with pytest.raises(pica.SceneError, match="roughness"):
        edits.apply([(material, "metallic", 0.0), (material, "roughness", 2.0)])
    assert (material.metallic, material.roughness, edits.can_undo) == (1.0, 0.5, False)


def test_an_undo_of_several_fields_puts_back_the_first_values(material):
    edits = Edits()
    edits.apply([(material, "metallic", 0.5), (material, "metallic", 0.0)])
    edits.undo()
    assert material.metallic == 1.0
