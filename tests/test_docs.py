"""The pages: every link and picture leads somewhere."""

import importlib
import re
import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "scripts"))  # at the end: gallery is a package, and a script there
recipe_table = importlib.import_module("recipe_table")
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
MOST_BYTES = {"README.md": 7_000, "docs/manual.md": 45_000, "docs/developers.md": 25_000, "BENCHMARKS.md": 12_000}
GERMAN = runpy.run_path(ROOT / "shutter_addon" / "blender" / "interface" / "translations" / "german.py")["MESSAGES"]
# What the pages for editors name of Blender and other programs, in italics as our own labels.
BLENDERS = {
    *("2D Stabilization", "Alpha Over", "Annotate Polygon", "Cryptomatte", "File Output", "Frame Dropping"),
    *("Generated", "Keyframe Type", "Pass Index", "Rendered", "Replace"),
    *("Single Image", "Standard", "Sync", "ACES", "ADX", "AgX", "Khronos PBR Neutral", "Big Buck Bunny"),
}


def prose(page):
    return re.sub(r"(?ms)^```.*?^```$", "", page.read_text(encoding="utf-8"))


def anchors(page):
    headings = re.findall(r"(?m)^#+ (.+)$", prose(page))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_links_lead_somewhere_and_every_page_and_picture_is_linked():
    linked = set()
    for page in PAGES:
        for link in re.findall(r"\]\((?!https://)([^)]+)\)", prose(page)):
            name, _, anchor = link.partition("#")
            target = (page.parent / name).resolve() if name else page
            assert target.exists(), f"{link} in {page.name}"
            assert not anchor or anchor in anchors(target), f"{link} in {page.name}"
            linked |= {target} if name else set()
    assert not {path for path in (ROOT / "docs").rglob("*") if path.is_file()} - linked


def test_what_the_page_of_developers_says_where_to_look_is_there():
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


def test_files_that_pages_name_are_there():
    places = ROOT, ROOT / "shutter_addon", ROOT / "shutter_addon" / "blender", ROOT / "docs"
    for page in PAGES:
        if page.name == "CHANGELOG.md":  # it may name what is gone
            continue
        text = page.read_text(encoding="utf-8")
        paths = re.findall(r"`([\w.-]+/[\w./-]+\.(?:py|glsl|md|toml|yml|yaml|sha256|avi|mp4))`", text)
        scripts = re.findall(r"(?<![\w./])(scripts/\w+(?:\.py)?)", text)
        for name in {*paths, *scripts}:
            assert any((place / name).exists() for place in places), f"{name} in {page.name}"


def test_pages_are_short():
    for name, most in MOST_BYTES.items():
        assert (ROOT / name).stat().st_size <= most, name


@pytest.mark.parametrize("name", ["README.md", "docs/manual.md"])
def test_pages_for_editors_have_the_labels_of_the_interface(name):
    """Labels are in italics; captions are, too, but begin and end a line."""
    labels = {message for _context, message in GERMAN} | BLENDERS
    text = re.sub(r"(?ms)^\*[^*\s][^*]{40,}?\*$", "", prose(ROOT / name)).replace("**", "")
    for said in re.findall(r"(?<!\w)\*([^*|]+?)\*", " ".join(text.split())):
        if "▸" not in said and "…" not in said and "ShutterApp" not in said:
            assert said in labels or set(said.split(": ")) <= labels, f"{said} in {name}"


def test_the_page_of_the_command_has_its_options():
    files = (ROOT / "shutter_addon").rglob("*command*.py")
    options = {word for file in files for word in re.findall(r'"(--[a-z-]+)"', file.read_text(encoding="utf-8"))}
    page = recipe_table.COMMAND.read_text(encoding="utf-8")
    hidden = {"--attached"}  # for a bake that the window starts
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", page)) == options - hidden


def test_the_tables_of_properties_are_those_of_the_model():
    for page, text in recipe_table.pages():
        assert page.read_text(encoding="utf-8") == text, "run scripts/recipe_table.py"
    assert "| `softness` |" in recipe_table.COMMAND.read_text(encoding="utf-8")
    assert "| *Softness* |" in recipe_table.MANUAL.read_text(encoding="utf-8")
