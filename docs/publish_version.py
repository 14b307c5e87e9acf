"""Puts a built site beside those of other versions: ``python docs/publish_version.py SITE PAGES VERSION``.

``PAGES`` holds a folder for each version. Its start page leads to the newest release and lists all.
"""

import re
import shutil
import sys
from pathlib import Path

VERSION = re.compile(r"\d+(\.\d+)*((a|b|rc|\.dev|\.post)\d+)?")
START = """<!doctype html>
<meta charset="utf-8">
<meta http-equiv="refresh" content="0; url={newest}/">
<title>wmr-replay</title>
<p>Documentation of <a href="{newest}/">wmr-replay {newest}</a>. All versions:</p>
<ul>
{versions}
</ul>
"""


def order(version: str) -> tuple[bool, list[int]]:
    """Finished releases above candidates, then by number."""
    numbers = [int(number) for number in re.findall(r"\d+", version)]
    return re.fullmatch(r"[\d.]+(\.post\d+)?", version) is not None, numbers


def publish(site: Path, pages: Path, version: str) -> None:
    """Replace the version's folder, and write the start page. Raises ValueError for what is no version."""
    if VERSION.fullmatch(version) is None:
        raise ValueError(f"{version!r} is no version")
    shutil.rmtree(pages / version, ignore_errors=True)
    shutil.copytree(site, pages / version)
    (pages / ".nojekyll").touch()
    folders = [path.name for path in pages.iterdir() if path.is_dir() and VERSION.fullmatch(path.name)]
    newest_first = sorted(folders, key=order, reverse=True)
    listed = "\n".join(f'<li><a href="{name}/">{name}</a></li>' for name in newest_first)
    (pages / "index.html").write_text(START.format(newest=newest_first[0], versions=listed), encoding="utf-8")


if __name__ == "__main__":
    publish(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
