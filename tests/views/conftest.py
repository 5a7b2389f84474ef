"""Maps and pages that several tests of reports share; one browser a process."""

import shutil

import pytest
from report_pages import ReportTab, map_of

import sweeps
from sweeps.maps.storage import open_map, write_map
from sweeps.views import report

plane = pytest.fixture(lambda: map_of("plane"), scope="session")
breakdown_map = pytest.fixture(lambda: map_of("bodies"), scope="session")
uncertain = pytest.fixture(lambda: map_of("uncertain"), scope="session")
shapes = pytest.fixture(lambda: map_of("shapes"), scope="session")


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("there is no Chromium: the report's own tests did not run")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def visit(browser):
    """Open reports; after the test, check that their consoles are empty and close their windows."""
    tabs = []

    def opens(path, link="", **context):
        tabs.append(ReportTab(browser, path, link, **context))
        return tabs[-1]

    yield opens
    for tab in tabs:
        tab.context.close()
    assert [message for tab in tabs for message in tab.messages] == []


@pytest.fixture
def visit_map(visit, tmp_path):
    """Write the report of a map, or of a definition, and open it."""

    def opens(ds, link="", **context):
        path = tmp_path / "page.html"
        report.write_report(sweeps.survey(ds) if isinstance(ds, dict) else ds, path)
        return visit(path, link, **context)

    return opens


@pytest.fixture(scope="session")
def pages(tmp_path_factory):
    return tmp_path_factory.mktemp("reports")


@pytest.fixture(scope="session")
def plane_path(plane, pages):
    """The report of a map that has gone through a file, as the workflow makes it."""
    write_map(plane, pages / "plane.nc")
    with open_map(pages / "plane.nc") as ds:
        report.write_report(ds, pages / "plane.html")
    return pages / "plane.html"


@pytest.fixture(scope="session")
def shared(browser, plane_path):
    page = ReportTab(browser, plane_path)
    page.first = page.page.evaluate("(({ listeners, ...chosen }) => chosen)(polhode.state)")
    yield page
    page.context.close()


@pytest.fixture
def tab(shared, plane_path):
    """The page as it was when it opened: unpacking it takes seconds, so that tests share one."""
    shared.page.evaluate(
        """(first) => {
            document.querySelectorAll("details[open]").forEach((details) => details.removeAttribute("open"));
            document.activeElement.blur();
            if (polhode.motion.player.playing) document.getElementById("play").click();
            polhode.choose(first);
            for (const name of ["Zoom", "Reset axes"]) document.querySelector(`#map [data-title="${name}"]`).click();
            scrollTo(0, 0);
        }""",
        shared.first,
    )
    shared.page.mouse.move(0, 0)
    yield shared
    assert shared.messages == []
    assert {url.split("#")[0] for url in shared.requests} == {plane_path.as_uri()}


@pytest.fixture(scope="session")
def shapes_path(shapes, pages):
    report.write_report(shapes, pages / "any-body.html")
    return pages / "any-body.html"
