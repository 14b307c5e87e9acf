"""README followed word by word: every command that it names, in its order, in a fresh copy and environment.

Nothing is downloaded: where pip would fetch packages, the new environment sees those of this one.
``make test`` is listed and not run, being what runs this test; uv has a stand-in where it is missing.
"""

import importlib.util
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from types import ModuleType

import pytest

needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
WITHOUT_MAKE = "## Installing without make"
LEFT_OUT = ("*.venv", ".git", ".*_cache", ".hypothesis", "__pycache__", "bench", "demo", "site", "dist")
STEP = "=== step"
STAND_INS = {
    "python3": """{python} "$@" || exit
if [ "$1 $2" = "-m venv" ]; then
    echo "{packages}" > "$(echo "$3"/lib/python*/site-packages)/others.pth"
fi""",
    "make": """if [ "$1" = test ]; then set -- --dry-run test; fi
exec {make} "$@" """,
    "shell": "command -v wmr-replay",
    "uv": """[ "$1 $2" = "run --no-sync" ] && shift 2 && exec ".venv/bin/$@" """,
}
"""Programs in front of those of the system; ``shell`` is what `make shell` opens."""


@pytest.fixture(scope="module")
def pages(root: Path) -> ModuleType:
    """What reads and runs the blocks of pages."""
    spec = importlib.util.spec_from_file_location("run_commands_of_readme", root / "docs" / "run_commands.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def readme(root: Path) -> str:
    """README; what its blocks say of not being run is for those who run them without a fresh copy."""
    return (root / "README.md").read_text(encoding="utf-8").replace("<!-- not run:", "<!-- here run:")


@pytest.fixture(scope="module")
def terminal(tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str]) -> dict[str, str]:
    """The environment of a terminal that knows nothing of this one, and finds the stand-ins first."""
    folder = tmp_path_factory.mktemp("stand-ins")
    names = {
        "python": Path(sys.base_prefix, "bin", f"python{sys.version_info.major}.{sys.version_info.minor}"),
        "packages": sysconfig.get_path("purelib"),
        "make": shutil.which("make"),
    }
    for name, script in STAND_INS.items():
        if name == "uv" and shutil.which("uv"):
            continue
        (folder / name).write_text("#!/bin/sh\n" + script.format(**names) + "\n", encoding="utf-8")
        (folder / name).chmod(0o755)
    others = [place for place in environment["PATH"].split(":") if not place.startswith(sys.prefix)]
    offline = {"PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    ours = {"PATH": ":".join([str(folder), *others]), "SHELL": str(folder / "shell"), "MPLBACKEND": "Agg"}
    return environment | offline | ours | {"NO_COLOR": "1"}


def fresh_copy(root: Path, place: Path) -> Path:
    """The sources as someone has them who just fetched them."""
    return Path(shutil.copytree(root, place / "wmr-replay", ignore=shutil.ignore_patterns(*LEFT_OUT)))


def session(commands: list[tuple[str, str]], here: Path, terminal: dict[str, str]) -> list[str]:
    """What each of the blocks (kind, text) prints, all typed into one terminal."""
    texts = {"sh": "{}", "python": "python - <<'PROGRAM'\n{}PROGRAM"}
    lines = [f'echo "{STEP}"\n{texts[kind].format(body)}' for kind, body in commands]
    call = ["bash", "-euo", "pipefail", "-c", "\n".join(lines)]
    done = subprocess.run(call, cwd=here, env=terminal, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.split(f"{STEP}\n")[1:]


@needs_make
@pytest.mark.slow
def test_every_command_of_readme_works_in_its_order(
    root: Path, readme: str, pages: ModuleType, tmp_path: Path, terminal: dict[str, str]
) -> None:
    """One terminal session, from `make demo` on. Before `wmr-replay` is first typed, the logs are put there
    that README speaks of.
    """
    here = fresh_copy(root, tmp_path)
    steps = [s for s in pages.steps(readme.partition(WITHOUT_MAKE)[0]) if s.kind in {"sh", "python"}]
    install, activate, *others = steps
    assert install.body.split()[:2] == ["make", "demo"]
    assert "source .venv/bin/activate" in activate.body
    logs = f'ROOT="{here}"\n' + pages.settings()["README.md"]["prepare"]
    blocks = [install, activate, pages.Step("sh", logs, 0), *others]
    printed = session([(step.kind, step.body) for step in blocks], here, terminal)
    assert len(printed) == len(blocks) >= 6
    for step, text in zip(blocks, printed, strict=True):
        assert step.expected is None or pages.first_difference(step.expected, text) is None
    assert f"{here}/.venv/bin/wmr-replay" in printed[1].splitlines()
    found = [path.name for path in (here / "demo.wmr").iterdir()]
    for ending in promised(readme):
        assert any(name.endswith(ending) for name in found), ending


def promised(readme: str) -> list[str]:
    """Endings of the files that README's table says `run` writes."""
    rows = [line.split("|")[1] for line in readme.splitlines() if line.startswith("| `<stem>.")]
    endings = [name.replace("<stem>", "") for row in rows for name in row.split("`")[1::2]]
    assert len(endings) >= 7
    return endings


@pytest.mark.slow
def test_installing_with_pip_as_readme_says(
    root: Path, readme: str, pages: ModuleType, tmp_path: Path, terminal: dict[str, str]
) -> None:
    """The block for uv needs a network: uv fetches what it installs."""
    here = fresh_copy(root, tmp_path)
    with_pip, with_uv = (s.body for s in pages.steps(readme.partition(WITHOUT_MAKE)[2]) if s.kind == "sh")
    assert with_uv.startswith("uv venv")
    where = (
        '.venv/bin/python -c "import wmr_replay; print(wmr_replay.__file__)"\n.venv/bin/wmr-replay --version'
    )
    _, printed = session([("sh", with_pip), ("sh", where)], here, terminal)
    assert printed.startswith(f"{here}/replay/wmr_replay/__init__.py\nwmr-replay, version ")
