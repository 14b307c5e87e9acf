"""What ``gap`` says of a log, against what is hidden and what the oracle allows.

right     the truth named, alone or beside rivals that the oracle cannot separate; or a refusal where the
          oracle refuses; or, where the model's own slipping or skidding is as likely, an answer that says so;
          where the hidden form is not the declared one, a formula beside the truth may describe the rest
refused   nothing named where the log tells; wrong all the same, and counted by itself
wrong     a name that is not there, or the truth beside names that the log excludes
error     the analysis raised
silent    (nothing hidden) nothing is named
false     (nothing hidden) something is named
unnamed   (nothing hidden) a disagreement without a name
"""

from collections.abc import Sequence
from typing import Any

from wmr_schemas.effects import UNNAMED_PREFIX, effects_of
from worlds.oracle import SKIDDING, SLIPPING, Judgement, exact_class

CLAIMS = ("named", "ambiguous")
CLOSE_BIC = 10.0
"""An answer says an alternative where its BIC is worse by less than this."""
Row = dict[str, Any]


def names_said(effects: Sequence[Row]) -> set[str]:
    """All names of the catalogue that the answer gives, close alternatives and exact classes included."""
    said: set[str] = set()
    for effect in effects:
        close = [name for name, worse in effect["alternatives"].items() if worse < CLOSE_BIC]
        said |= {effect["name"], *close, *effect["class"]}
    return said & set(effects_of("torque"))


def terms_said(row: Row) -> list[str]:
    """The terms of the formula that the answer gives."""
    return [effect["name"] for effect in row.get("effects", ()) if is_term(effect)]


def is_term(effect: Row) -> bool:
    """Whether an effect of an answer is a formula's term."""
    return bool(effect["name"].startswith(UNNAMED_PREFIX))


def says_mode(row: Row, judgement: Judgement) -> bool:
    """Whether the sentence or notes speak of the contact mode that is as likely as what is hidden."""
    words = {SLIPPING: "slip", SKIDDING: "skid"}
    modes = [word for mode, word in words.items() if mode in judgement.inseparable]
    return any(mode in text for mode in modes for text in (row["sentence"], *row["notes"]))


def outcome(row: Row, judgement: Judgement | None) -> str:
    """One of the words above; ``judgement`` None where nothing is hidden."""
    if "error" in row:
        return "error"
    claims = row["verdict"] in CLAIMS
    if judgement is None:
        return "false" if claims else "unnamed" if row["verdict"] == "unnamed" else "silent"
    if not claims:
        return "right" if judgement.may_refuse or says_mode(row, judgement) else "refused"
    hidden, said = row["effect"], names_said(row["effects"])
    allowed = judgement.inseparable | exact_class(hidden) | {hidden}
    terms = 0 if row.get("same_form", True) else len(terms_said(row))
    one = len(row["effects"]) - terms == 1
    return "right" if one and hidden in said and said <= allowed else "wrong"


def holds(row: Row) -> dict[str, bool]:
    """Whether each interval holds the parameter in ``fitted``, where the hidden effect is named first."""
    if not row.get("effects") or row["effects"][0]["name"] != row["effect"]:
        return {}
    found = row["effects"][0]["parameters"]
    return {
        key: found[key][1] <= size <= found[key][2] for key, size in row["fitted"].items() if key in found
    }
