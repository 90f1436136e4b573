"""Browser for tests of pages: Debian's chromium without a screen, drawing in software."""

import io
import math
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

import numpy as np
import pytest

from coneskin.geometry.pose import Vector
from coneskin.view.page_server import PageServer

FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
SIZE = {"width": 820, "height": 400}
TIMEOUT = 120_000.0  # ms; a busy machine draws slowly


@contextmanager
def browser_page() -> Iterator[Any]:
    """Open a page of a browser; skip the test where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no browser is driven")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("chromium is not installed (Debian: apt-get install chromium): the page is not looked at")
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=list(FLAGS))
        try:
            page = browser.new_page(viewport=SIZE)
            page.set_default_timeout(TIMEOUT)
            page.wrong = []
            page.on("pageerror", lambda error: page.wrong.append(str(error)))
            yield page
        finally:
            browser.close()


def wait_for_text(page: Any, selector: str, text: str) -> None:
    """Wait until an element of the page has a text."""
    page.wait_for_function(
        "([selector, text]) => [...document.querySelectorAll(selector)].some((e) => e.textContent.includes(text))",
        arg=[selector, text],
    )


def look_closely(server: PageServer, page: Any, point: Vector, normal: Vector) -> tuple[int, int]:
    """Move the camera in front of a place, and return where on the page it then is [pixels]."""
    (client,) = server._server.get_clients().values()
    side = np.cross(normal, (0.3, 0.5, 0.8))
    client.camera.position = tuple(np.array(point) + 0.35 * np.array(normal) + 0.12 * side / np.linalg.norm(side))
    client.camera.look_at = point
    page.wait_for_timeout(300)  # until the page has told its new camera
    camera = client.camera
    x, y, z = np.array(rotation(camera.wxyz)).T @ (np.array(point) - camera.position)
    canvas = max((item.bounding_box() for item in page.query_selector_all("canvas")), key=lambda box: box["width"])
    focal = 0.5 * canvas["height"] / math.tan(0.5 * camera.fov)
    assert z > 0.1
    return (
        round(canvas["x"] + 0.5 * canvas["width"] + focal * x / z),
        round(canvas["y"] + 0.5 * canvas["height"] + focal * y / z),
    )


#: moves the camera of a page without a server to a place of a node's frame; tells where a point is [pixels]
_MOVE = """([name, eye, at]) => new Promise((done) => {
  const page = window.__viserMutable;
  const base = page.nodeRefFromName[name];
  const there = (point) => base.localToWorld(new base.position.constructor(...point));
  const [from, to] = [there(eye), there(at)];
  page.cameraControl.setLookAt(from.x, from.y, from.z, to.x, to.y, to.z, false);
  page.requestRender();
  setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(() => {
    const box = page.canvas.getBoundingClientRect();
    const seen = there(at).project(page.camera);
    done([box.left + 0.5 * box.width * (1.0 + seen.x), box.top + 0.5 * box.height * (1.0 - seen.y)]);
  })), 500);
})"""


def look_closely_at_a_file(page: Any, base: str, point: Vector, normal: Vector) -> tuple[int, int]:
    """Move the camera of a page without a server in front of a place of the base frame, and return where it is."""
    side = np.cross(normal, (0.3, 0.5, 0.8))
    eye = np.array(point) + 0.35 * np.array(normal) + 0.12 * side / np.linalg.norm(side)
    x, y = page.evaluate(_MOVE, [base, eye.tolist(), list(point)])
    return round(x), round(y)


def rotation(wxyz: Any) -> list[list[float]]:
    """Rotation matrix of a quaternion."""
    w, x, y, z = (float(value) for value in wxyz)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def pixels(page: Any, at: tuple[int, int], around: int = 5) -> np.ndarray:
    """The page's pixels about a place, as red, green and blue."""
    from PIL import Image

    # viser 1.1.1 lays a note about drawing without a GPU over the picture, which these computers all get
    page.add_style_tag(content="[class*=Notifications-root] { display: none !important }")
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)
    return picture[at[1] - around : at[1] + around + 1, at[0] - around : at[0] + around + 1].reshape(-1, 3)


def wait_for_pixels(page: Any, at: tuple[int, int], right: Callable[[np.ndarray], bool], around: int = 5) -> None:
    """Wait until a place of the page looks right: a busy computer draws late, and fades what is old."""
    end = monotonic() + 1e-3 * TIMEOUT
    while not right(found := pixels(page, at, around)):
        assert monotonic() < end, f"the place does not look so: {np.unique(found, axis=0)[:20]}"
        page.wait_for_timeout(100)


def magenta(found: np.ndarray) -> int:
    """How many of some pixels have the colour of a contact whose place is certain."""
    red, green, blue = found.T
    return int(((red > 90) & (green < 0.6 * red) & (blue > 0.75 * red)).sum())


def quiet(found: np.ndarray) -> int:
    """How many of some pixels have the colour of a sheet that nothing touches."""
    red, green, blue = found.T
    return int(((blue > 1.2 * green) & (green > red) & (blue < 110)).sum())


def shown_trace(page: Any) -> np.ndarray:
    """How far below the upper edge the trace is in each column of pixels, as a share of the height; NaN: nowhere."""
    from PIL import Image

    drawn = page.query_selector(".coneskin-plot svg").screenshot()
    red, green, blue = np.moveaxis(np.asarray(Image.open(io.BytesIO(drawn)).convert("RGB")).astype(int), 2, 0)
    line = (blue > red + 60) & (blue > green + 30)
    return np.where(line.any(axis=0), line.argmax(axis=0) / len(line), np.nan)


def violet(found: np.ndarray) -> int:
    """How many of some pixels have the colour of a low potential."""
    red, green, blue = found.T
    return int(((blue > 1.3 * red) & (blue > 1.3 * green)).sum())
