"""Effects that a log of poses and torques cannot tell apart, and the manoeuvres that separate others.

Both come from the declarations in ``wmr_schemas.effects``.
"""

from collections.abc import Iterator

from wmr_schemas.effects import EffectDeclaration, Manoeuvre, catalogue
from wmr_schemas.effects.declaration import DrivenBy


def confound_class(names: tuple[str, ...], name: str, *, driven_by: DrivenBy = "torque") -> tuple[str, ...]:
    """All that cannot be told from ``name`` beside the other effects ``names`` of a model, itself first;
    ``driven_by`` says what drives the model.
    """
    found = {name}
    for effect in catalogue().values():
        for confound in effect.exact:
            members = {effect.name, *confound.beside}
            if driven_by in confound.driven_by and name in members and members <= set(names):
                found |= set(confound.same_as)
    return (name, *sorted(found - {name}))


def separate_with(name: str, alternatives: tuple[str, ...]) -> str:
    """The manoeuvres that tell ``name`` from the alternatives; empty where none is needed or known."""
    wanted = {
        manoeuvre
        for effect in catalogue().values()
        for members, manoeuvre in groups_of(effect)
        if name in members and any(other in members for other in alternatives)
    }
    known = [manoeuvre.value for manoeuvre in Manoeuvre if manoeuvre in wanted]
    return "; ".join([*known, *sorted(words for words in wanted if isinstance(words, str))])


def groups_of(effect: EffectDeclaration) -> Iterator[tuple[set[str], Manoeuvre | str]]:
    """The groups that an effect's declaration says are separable, with the manoeuvre."""
    for group in effect.separable:
        yield {effect.name, *group.others}, group.by
