"""What `make docs` adds to the pages of this folder: front page, notebooks, nodes, and what scripts may call.

MkDocs runs the functions as hooks, and Griffe, which reads the sources without importing them, the class.
"""

import re
import sys
from pathlib import Path

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from pygments.formatters import HtmlFormatter

import underfoot

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "workbench"
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
NAMES = "reference/names.md"
NOT_FOR_SCRIPTS = ("bench", "commands", "nodes")
"""Packages without a page: two are reached from the command line, and `underfoot nodes` prints the third."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the pages of the reference behind the others."""
    assert config.nav is not None
    names = [path.stem for path in NOTEBOOKS]
    config.nav.append({"Notebooks": [{name[2:].replace("-", " ").capitalize(): _notebook(name)} for name in names]})
    config.nav.append({"Nodes": "reference/nodes.md"})
    config.nav.append({"Names for scripts": NAMES})
    config.nav.append({"Reference": [{name: _page(name)} for name in _modules()]})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made: README, CONTRIBUTING, and the reference."""
    made = {"index.md": _from_docs("README.md"), "contributing.md": _from_docs("CONTRIBUTING.md")}
    sys.path.insert(0, str(ROOT / "docs"))
    import cells
    import node_pages

    made["reference/nodes.md"] = node_pages.page()
    made[NAMES] = _names()
    made |= {_notebook(path.stem): cells.markdown(path) for path in NOTEBOOKS}
    for name, modules in _modules().items():
        made[_page(name)] = f"# {name}\n\n" + "\n\n".join(f"::: {module}" for module in modules) + "\n"
    made["code.css"] = HtmlFormatter().get_style_defs(".highlight")  # the theme has no colours for code
    for path, text in made.items():
        files.append(File.generated(config, path, content=text))
    for picture in sorted((ROOT / "assets").glob("*.png")):
        files.append(File.generated(config, f"assets/{picture.name}", abs_src_path=str(picture)))
    return files


def _from_docs(name: str) -> str:
    """A page of the project's top folder, with its links to other pages as they are from there."""
    text = (ROOT / name).read_text(encoding="utf-8")
    return text.replace("](docs/", "](").replace("](CONTRIBUTING.md)", "](contributing.md)")


def _notebook(name: str) -> str:
    return f"notebooks/{name}.md"


def _page(name: str) -> str:
    return f"reference/{name}.md"


def _names() -> str:
    """The page of the names that `import underfoot` provides, each from where it is written."""
    parts = ["# Names for scripts", "What `import underfoot` provides ([scripting](../scripting.md))."]
    for name in underfoot.__all__[1:]:  # the first is the version
        place = getattr(underfoot, name).__module__
        parts.append(f"::: {place}.{name}\n    options:\n      show_root_full_path: false")
    return "\n\n".join(parts) + "\n"


def _modules() -> dict[str, list[str]]:
    """Modules by page: a page for each package, and one for the modules that stand in none."""
    pages: dict[str, list[str]] = {}
    for path in sorted(SOURCES.rglob("*.py")):
        place = path.relative_to(SOURCES).with_suffix("").parts
        if place[0] in NOT_FOR_SCRIPTS or place[-1] in ("__main__", "start"):
            continue
        package = ("underfoot", *place[:-1])
        module = package if place[-1] == "__init__" else (*package, place[-1])
        if not place[-1].startswith("_") or module == package:
            pages.setdefault(".".join(package), []).append(".".join(module))
    return {name: pages[name] for name in sorted(pages)}


class Doctests(griffe.Extension):
    """Examples in docstrings (`>>>`) as code: Markdown would take them for quotations."""

    def on_object(self, *, obj: griffe.Object, **_: object) -> None:
        """Put fences around the examples of an object's docstring."""
        if obj.docstring is not None:
            obj.docstring.value = re.sub(
                r"^>>> .*(?:\n(?!\s*$).*)*", lambda found: f"```pycon\n{found[0]}\n```", obj.docstring.value, flags=re.M
            )

    def on_package(self, *, pkg: griffe.Module, **_: object) -> None:
        """Do so for the package itself, too, which Griffe does not take for one of its objects."""
        self.on_object(obj=pkg)
