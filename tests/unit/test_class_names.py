"""One meaning for each name of a class: no two public classes of the product share a name."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]
PRODUCT = ("dsl", "services", "sim_mujoco", "bt_missions")
ASYNCHRONOUS = "aio.py"
"""Variant of the module beside it, with the same classes for `asyncio`."""
FROM_BOTH_ENDS = {"Goal", "Resource"}
"""Concepts that a client sees from its end: the goal of a skill's hooks, and the resource of the model."""


def homes(files: Iterable[Path]) -> dict[str, list[Path]]:
    """Names of public classes, each with the files that define one."""
    found: dict[str, list[Path]] = defaultdict(list)
    for path in files:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and path.name != ASYNCHRONOUS:
                found[node.name].append(path)
    return found


def shared(found: Mapping[str, list[Path]]) -> dict[str, list[Path]]:
    return {name: sorted(paths) for name, paths in found.items() if len(paths) > 1}


def test_no_two_classes_of_the_product_share_a_name() -> None:
    found = shared(homes(path for root in PRODUCT for path in (ROOT / root / "skillwing").rglob("*.py")))
    doubles = [
        f"`{name}`: {', '.join(str(path.relative_to(ROOT)) for path in paths)}"
        for name, paths in found.items()
        if name not in FROM_BOTH_ENDS
    ]
    assert doubles == [], (
        "Rename all but one of these classes, each by its own meaning. Messages keep their names, because generated "
        "pages have them; so do classes for developers of skills."
    )
    assert found.keys() >= FROM_BOTH_ENDS, "Remove from FROM_BOTH_ENDS what has one class only."


def test_variants_for_asyncio_and_private_classes_do_not_count(tmp_path: Path) -> None:
    texts = {
        "sync.py": "class Client: ...",
        "aio.py": "class Client: ...",
        "one.py": "class _Row: ...\nclass Battery: ...",
        "other.py": "class _Row: ...\nclass Battery: ...",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert shared(homes(tmp_path.iterdir())) == {"Battery": [tmp_path / "one.py", tmp_path / "other.py"]}
