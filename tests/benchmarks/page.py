"""Speed of the page of a map: until it can be used, a step of a slider, and pictures a second of Play.

    python tests/benchmarks/page.py [MAP ...]

prints for each map: bytes of the page; from the first byte to the end of its building, s, the median of several
openings; a step of every slider, from the event to the picture that follows it, s; the intervals between the frames of
Play, ms; each with the processor time of the page's main thread, which a busy machine leaves nearly as it is. Without a
map, the default sweep's (331,776 points) is measured first. Chromium without a graphics card draws with the processor:
so a frame includes what a card would do.
"""

import shutil
import statistics
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import sweeps
from sweeps.maps import storage
from sweeps.points import catalogue
from sweeps.views import report

ROUNDS = 3
STEPS = 9  # steps of each slider
PLAYED = 4000  # ms
SCREEN = {"width": 1280, "height": 800}

SLIDERS = "#controls input[type=range], .player input[type=range]"
STEP = """async ([input, steps]) => {
    const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    const taken = [];
    for (let i = 0; i < steps; i++) {
        await painted();
        const begun = performance.now();
        input.value = String((Number(input.value) + 1) % (Number(input.max) + 1));
        input.dispatchEvent(new Event("input", { bubbles: true }));
        await painted();
        taken.push((performance.now() - begun) / 1000);
    }
    return [input.getAttribute("aria-label"), taken];
}"""
FRAMES = """(wanted) => new Promise((done) => {
    const taken = [];
    let last = null;
    const look = (now) => {
        if (last !== null) taken.push(now - last);
        last = now;
        if (taken.reduce((sum, one) => sum + one, 0) < wanted) requestAnimationFrame(look);
        else done(taken);
    };
    const button = document.getElementById("play");
    if (button.getAttribute("aria-pressed") !== "true") button.click();
    requestAnimationFrame(look);
})"""


class Window:
    """A page in a window of its own, built.

    Attributes:
        page: the page.
        usable: s until it could be used, by the page's own clock.
        processor: s of processor that its main thread took until then.
    """

    def __init__(self, browser, path):
        self.page = browser.new_context(viewport=SCREEN, reduced_motion="reduce").new_page()
        self._session = self.page.context.new_cdp_session(self.page)
        self._session.send("Performance.enable")
        begin = self.processor_time()
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-ready]", state="attached", timeout=120_000)
        self.processor = self.processor_time() - begin
        self.usable = self.page.evaluate("performance.getEntriesByName('usable')[0].startTime / 1000")

    def processor_time(self):
        """Processor time of the page's main thread, s."""
        metrics = self._session.send("Performance.getMetrics")["metrics"]
        return next(metric["value"] for metric in metrics if metric["name"] == "ThreadTime")

    def evaluate(self, expression, argument=None):
        """Return the value of an expression, and the processor time of the main thread meanwhile, s."""
        begin = self.processor_time()
        result = self.page.evaluate(expression, argument)
        return result, self.processor_time() - begin

    def close(self):
        """Closes the window."""
        self.page.context.close()


def openings(browser, path):
    """The page opened several times; the last window stays open."""
    windows = []
    for _ in range(ROUNDS):
        windows and windows[-1].close()
        windows.append(Window(browser, path))
    return windows


def show(name, times, unit, processor=None):
    """One line: the median, the least and the most; and processor time, ms."""
    middle, low, high = statistics.median(times), min(times), max(times)
    processor_text = "" if processor is None else f"  {1000 * processor:8.1f} ms of processor"
    print(f"  {name:50} {middle:8.3f} {unit:3} ({low:.3f} to {high:.3f}){processor_text}")


def measure(browser, path):
    """All lines of one page."""
    print(f"{path.name}: {path.stat().st_size:,} bytes")
    windows = openings(browser, path)
    usable, processor = ([getattr(window, name) for window in windows] for name in ("usable", "processor"))
    show("usable after", usable, "s", statistics.median(processor))
    window, page = windows[-1], windows[-1].page
    for slider in filter(lambda one: one.is_visible(), page.query_selector_all(SLIDERS)):
        (name, step_times), seconds = window.evaluate(STEP, [slider, STEPS])
        show(f"a step of {name}"[:50], step_times, "s", seconds / STEPS)
    if page.locator("#play").count() and page.locator("#play").is_visible():
        page.wait_for_timeout(500)
        frames, seconds = window.evaluate(FRAMES, PLAYED)
        show("between two frames of Play", frames, "ms", seconds / len(frames))
        print(f"  {1000 * len(frames) / sum(frames):.1f} pictures a second")
    window.close()


def main():
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        paths = [Path(name) for name in sys.argv[1:]] or [Path(folder) / "map.nc"]
        if not sys.argv[1:]:
            storage.write_map(sweeps.survey(catalogue.DEFAULT), paths[0])
        chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for path in paths:
            page = Path(folder) / f"{path.stem}.html"
            with storage.open_map(path) as ds:
                report.write_report(ds, page)
            measure(browser, page)
        browser.close()


if __name__ == "__main__":
    main()
