# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Reports of the committed run and of a study, in a real browser: complete, on a phone, on A4."""

import base64
import importlib
import re
import shutil
import sys
from pathlib import Path

import pytest
from selenium.webdriver.support.ui import WebDriverWait

from gait_entrainment_commands import main
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.session_file import read_session

sys.path.insert(0, str(Path(__file__).parent))
chromium = importlib.import_module("browser").chromium

ROOT = Path(__file__).parents[1]
BAG = ROOT / "bags/paper_example"
PHONE, DESKTOP = (390, 844), (1280, 900)
TIMEOUT = 60.0  # [s]
SESSION = """\
study: pilot
person: {code: CODE, number: NUMBER, mass: 72, leg_length: 0.91}
blocks: [{name: first}, {name: second}]
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Return reports: of a run, of a study of two persons, and of a sealed session."""
    folder = tmp_path_factory.mktemp("report")
    for code, study in (("P01", "study"), ("P02", "study"), ("P03", "sealed")):
        blind = "blind: true\n" if study == "sealed" else ""
        file = folder / f"{code}.yaml"
        file.write_text(blind + SESSION.replace("CODE", code).replace("NUMBER", code[1:]))
        session = SessionFolder.begin(folder / study, read_session(file))
        for number in (1,) if code == "P02" else (1, 2):
            bag = session.new_bag(number)
            shutil.copytree(BAG, bag)
            session.note("done", number, bag.name)
        session.note("note", 1, text="<script>document.title='hacked'</script> & more")
    out = {name: folder / f"{name}.html" for name in ("run", "study", "sealed")}
    for name, page in out.items():
        source = BAG if name == "run" else folder / name
        assert main(["report", str(source), "--out", str(page)]) == 0
    return out


@pytest.fixture(scope="module")
def browser():
    with chromium(DESKTOP) as driver:
        yield driver


def shown(browser, page, size):
    """Show a page at a size; return its text and its width."""
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.get(page.as_uri())
    # On a busy computer get returns before the page has loaded, whatever WebDriver promises.
    ready = "return document.readyState == 'complete'"
    WebDriverWait(browser, TIMEOUT).until(lambda shows: shows.execute_script(ready))
    text = browser.execute_script("return document.body.innerText")
    root = "document.documentElement"
    width = browser.execute_script(f"return {root}.scrollWidth")
    return text, width


def test_a_run_is_reported_from_its_soundness_to_its_origin(browser, pages):
    text, _ = shown(browser, pages["run"], DESKTOP)
    parts = [
        "verdict          entrained since stride 29",
        "Are the data sound?",
        "measured differs from commanded by 0.00 N m",
        "repeated: identical to the live one, bit for bit",
        "Protocol as run",
        "period_offset: -0.05",
        "Stride period",
        "Phase lag of the pulses",
        "Phase of the pulses in the stride",
        "Ankle torque stride by stride",
        "resultant length",
        "no proof of entrainment",
        "Origin",
        "SHA-256 of paper_example_0.mcap",
    ]
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert "BAD" not in text.upper().split()
    assert len(browser.find_elements("css selector", "figure svg")) == 4
    assert browser.get_log("browser") == []


@pytest.mark.parametrize("name", ["run", "study", "sealed"])
def test_a_page_needs_nothing_from_elsewhere(pages, name):
    page = pages[name].read_text()
    referred = re.findall(r'(?:src|href)="([^"]*)"|url\(([^)]*)\)', page)
    assert all("".join(link).startswith("#") for link in referred)
    assert "<script" not in page
    assert not re.findall(r'="https?:(?!//www\.w3\.org/)[^"]*"', page)


@pytest.mark.parametrize("name", ["run", "study"])
@pytest.mark.parametrize("size", [PHONE, DESKTOP])
def test_a_page_fits_its_screen(browser, pages, tmp_path, name, size):
    _, width = shown(browser, pages[name], size)
    assert width == size[0]
    # Text in figures stays readable.
    drawn = browser.execute_script(
        "return [...document.querySelectorAll('figure svg text')].map("
        "t => t.getBoundingClientRect().height)"
    )
    assert min(height for height in drawn if height) > 7
    assert browser.save_screenshot(str(tmp_path / "page.png"))
    assert (tmp_path / "page.png").stat().st_size > 20_000


def test_a_run_fits_a_few_sheets_of_a4(browser, pages):
    shown(browser, pages["run"], DESKTOP)
    printed = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    pdf = base64.b64decode(printed["data"])
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf)) <= 6
    boxes = {tuple(map(float, box.split())) for box in re.findall(rb"/MediaBox \[([^\]]*)\]", pdf)}
    assert {(round(box[2]), round(box[3])) for box in boxes} == {(595, 842)}


def test_a_study_begins_with_the_combined_results_of_its_runs(browser, pages):
    text, _ = shown(browser, pages["study"], DESKTOP)
    for part in (
        "P02, session 1, 1: first",
        "Largest offsets that entrained",
        "-2.59 (no larger one tried)",
        "Across persons",
        "Rayleigh's p over persons",
        "<script>document.title='hacked'</script> & more",
    ):
        assert part in text
    assert browser.title == "pilot: report"


def test_a_sealed_session_shows_only_whether_the_data_are_sound(browser, pages):
    text, _ = shown(browser, pages["sealed"], DESKTOP)
    assert "This session is sealed" in text
    assert "Are the data sound?" in text
    revealing = "first|second|entrained|messages|period_offset|stride period|from commanded|rate "
    assert not re.search(revealing, text)
    assert browser.find_elements("css selector", "svg") == []
