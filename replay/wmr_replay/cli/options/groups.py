"""The group of the help page in which each option stands; one that is not listed stands under Advanced."""

GROUPS = {
    "Input": (
        "--model",
        "--base-log",
        "--from",
        "--prove-on",
        "--robot",
        "--pose",
        "--torque",
        "--truth",
        "--map",
        "--clock",
        "--clock-offset",
        "--start",
        "--end",
        "--full",
        "--log",
        "--criteria",
        "--require",
        "--set-a",
        "--set-b",
    ),
    "Method": (
        "--identifier",
        "--evidence",
        "--min-confidence",
        "--modes",
        "--base",
        "--input",
        "--tolerance",
        "--max-effects",
        "--separate",
        "--hindsight",
        "--max-delay",
        "--hide",
        "--disturbance",
        "--duration",
        "--seed",
        "--verify",
        "--update",
        "--every",
    ),
    "Output": (
        "--out",
        "--to",
        "--into",
        "--joints",
        "--force",
        "--report",
        "--view",
        "--serve",
        "--bind",
        "--screenshot",
        "--rrd",
        "--no-rrd",
        "--plot",
        "--encoding",
        "--no-truth",
        "--no-truth-topic",
        "--write-map",
        "--diff",
        "--junit",
        "--json",
        "--strict",
        "--fail-on",
    ),
    "Advanced": (
        "--window",
        "--tune",
        "--lag",
        "--simultaneous",
        "--threshold-sd",
        "--min-sideslip",
        "--degree",
        "--kappa",
        "--mu",
        "--theta",
        "--scheduler",
    ),
    "General": (
        "--list",
        "--list-effects",
        "--jobs",
        "--config",
        "--quiet",
        "--verbose",
        "--version",
        "--help",
    ),
}
"""Groups and options in the order of the page. A command's own groups stand before Output."""
REST, BEHIND_OWN = "Advanced", "Output"


def groups_with(own: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """All groups of a page; an option of a group of the command's ``own`` leaves its common one."""
    taken = {option for options in own.values() for option in options}
    merged: dict[str, tuple[str, ...]] = {}
    for name, options in GROUPS.items():
        merged |= own if name == BEHIND_OWN else {}
        merged[name] = tuple(option for option in options if option not in taken)
    return merged
