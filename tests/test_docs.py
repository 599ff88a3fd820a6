"""The pages: every link and picture leads somewhere."""

import importlib
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "scripts"))  # at the end: gallery is a package, and a script there
recipe_table = importlib.import_module("recipe_table")
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]


def prose(page):
    """A page's text without its blocks of code."""
    return re.sub(r"(?ms)^```.*?^```$", "", page.read_text(encoding="utf-8"))


def anchors(page):
    """What its headings are called in links, as GitHub and its like make it of them."""
    headings = re.findall(r"(?m)^#+ (.+)$", prose(page))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)]+)\)", prose(page)):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_every_page_and_picture_is_linked():
    linked = {
        (page.parent / link.partition("#")[0]).resolve()
        for page in PAGES
        for link in re.findall(r"\]\(([^)]+)\)", prose(page))
        if not link.startswith("#")
    }
    files = {path for path in (ROOT / "docs").rglob("*") if path.is_file()}
    assert not files - linked


def test_what_the_page_of_developers_says_where_to_look_is_there():
    """Each file, and each name that stands in brackets behind one."""
    page = (ROOT / "docs" / "developers.md").read_text(encoding="utf-8")
    rows = page.partition("| Looking for | Open |")[2].partition("\n\n")[0].splitlines()[2:]
    assert len(rows) > 30
    for row in rows:
        folder, text = ROOT / "shutter_addon", ""
        for brackets, word in re.findall(r"(\(?)`([\w/.]+)`", row.rpartition(" | ")[2].replace(", `", ", (`")):
            if word.endswith((".py", ".glsl")):
                places = [ROOT / "shutter_addon" / word, ROOT / word, folder / word]
                file = next((place for place in places if place.is_file()), None)
                assert file, word
                folder, text = file.parent, file.read_text(encoding="utf-8")
            elif brackets and not word.endswith("/"):
                assert re.search(rf"\b(def|class|void) {word.rpartition('.')[2]}\b", text), f"{word} in {file.name}"


def test_the_tables_of_properties_are_those_of_the_model():
    for page, text in recipe_table.pages():
        assert page.read_text(encoding="utf-8") == text, "run scripts/recipe_table.py"
    assert "| `softness` |" in recipe_table.COMMAND.read_text(encoding="utf-8")
    assert "| *Softness* |" in recipe_table.MANUAL.read_text(encoding="utf-8")
