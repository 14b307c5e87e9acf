"""Blocks of figures in a page, ``<!-- figures NAME -->`` to ``<!-- end NAME -->``, and shares."""

import re
from collections.abc import Mapping

import numpy as np

BLOCK = re.compile(r"(<!-- figures (\w+) -->\n)(.*?)(<!-- end \2 -->)", re.DOTALL)
Z_95 = 1.96


def names(page: str) -> list[str]:
    """The names of a page's blocks."""
    return [block[2] for block in BLOCK.finditer(page)]


def filled(page: str, blocks: Mapping[str, str]) -> str:
    """The page with the given blocks replaced, each text ending its last line; the others stay.

    Raises ValueError for a block that the page has no place for.
    """
    if missing := sorted(set(blocks) - set(names(page))):
        raise ValueError(f"the page has no block {', '.join(missing)}")
    return BLOCK.sub(
        lambda m: m[1] + blocks[m[2]].rstrip("\n") + "\n" + m[4] if m[2] in blocks else m[0], page
    )


def share(hits: int, n: int) -> str:
    """A share with Wilson's 95 % interval."""
    if not n:
        return "–"
    p = hits / n
    middle, spread = p + Z_95**2 / (2 * n), Z_95 * np.sqrt(p * (1 - p) / n + Z_95**2 / (4 * n**2))
    low, high = ((middle + sign * spread) / (1 + Z_95**2 / n) for sign in (-1, 1))
    return f"{100 * p:.1f} % ({hits} of {n}; {100 * max(low, 0):.1f} to {100 * min(high, 1):.1f})"
