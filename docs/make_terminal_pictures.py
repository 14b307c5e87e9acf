"""Pictures of the terminal for the home page: ``python docs/make_terminal_pictures.py``.

Runs ``batch`` and ``check`` on short logs, and draws what they print as vector graphics below ``images/``.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.text import Text

IMAGES = Path(__file__).parent / "images"
COLUMNS = 100
PREPARE = """
for n in 1 2 3; do
    wmr-replay synth random --duration 20 --rate 50 --noise mocap --seed $n --out logs/monday-$n.mcap
done
wmr-replay check references logs --update
"""
SHOWN = {
    "batch": "wmr-replay batch logs/ --out fleet/",
    "check": "wmr-replay check references/ logs/ --threshold-sd 4",
}
SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">
<style>
.{unique_id}-matrix {{ font-family: ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace;
 font-size: {char_height}px; line-height: {line_height}px; }}
{styles}
</style>
<defs>{lines}</defs>
<rect width="{width}" height="{height}" rx="8" fill="#14181f"/>
<g transform="translate(20, 16)">{backgrounds}<g class="{unique_id}-matrix">{matrix}</g></g>
</svg>
"""


def run(commands: str, folder: str) -> str:
    """What the commands print, with colours; those that find something end with 1."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    ours = {"PATH": path, "COLUMNS": str(COLUMNS), "FORCE_COLOR": "1", "WMR_REPLAY_PROGRESS": "never"}
    call = ["sh", "-c", f"mkdir -p logs; {commands}"]
    done = subprocess.run(
        call, cwd=folder, env=os.environ | ours, capture_output=True, text=True, check=False
    )
    return done.stdout.replace(f"{folder}/", "")


def picture(command: str, printed: str) -> str:
    """The terminal with a command and its answer, as SVG."""
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        console = Console(record=True, width=COLUMNS, file=nowhere, force_terminal=True)
        console.print(Text.assemble(("$ ", "green"), (command, "bold")))
        console.print(Text.from_ansi(printed.strip("\n")))
        return console.export_svg(title="", code_format=SVG, unique_id="t")


def main() -> None:
    """Run and draw."""
    with tempfile.TemporaryDirectory() as folder:
        run(PREPARE, folder)
        for name, command in SHOWN.items():
            drawn = picture(command, run(command, folder))
            (IMAGES / f"{name}.svg").write_text(drawn, encoding="utf-8")


if __name__ == "__main__":
    main()
