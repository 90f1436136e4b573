"""The studio in a browser: a handle is moved, meshes are dropped and chosen, layers lie flat, a folder is written."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from coneskin.design.link_design import LinkMesh
from coneskin.design.studio.studio_page import StudioPage
from coneskin.design.studio.workbench import Workbench
from coneskin.view.page_server import PageServer
from tests.geometry.synthetic import placed, revolve
from tests.view.browser import browser_page, wait_for_text

#: how far the eye is from what it looks at [m]
DISTANCE = "() => window.__viserMutable.cameraControl.distance"
pytestmark = pytest.mark.long


def drop(page: Any, file: Path) -> None:
    """Drag a file from outside of the browser over the scene, and drop it there."""
    box = max((item.bounding_box() for item in page.query_selector_all("canvas")), key=lambda box: box["width"])
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    session = page.context.new_cdp_session(page)
    dragged = {"items": [], "files": [str(file)], "dragOperationsMask": 1}
    for step in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": step, "x": x, "y": y, "data": dragged})


def test_a_person_designs_a_sheet_and_then_one_for_another_link(tmp_path: Path) -> None:
    import trimesh

    mesh = placed(revolve([(0.0, 0.04), (0.2, 0.05)], segments=48, rings=6))
    other = tmp_path / "tube.stl"
    trimesh.creation.cylinder(radius=0.06, height=0.15, sections=48).export(other)
    folder = tmp_path / "skin"
    link = LinkMesh("link", mesh, "mesh", ())
    with PageServer("studio", port=18180, uploads=True) as server, browser_page() as page:
        StudioPage(server, Workbench.of(link), folder, False, Workbench.of)
        page.goto(server.url)
        wait_for_text(page, "#coneskin-facts", "theta0")
        page.wait_for_selector("#coneskin-flat svg path, #coneskin-flat svg polyline, #coneskin-flat svg line",
                               state="attached")  # fmt: skip
        page.wait_for_function(DISTANCE + " > 0.3")  # of a link of 0.2 m
        before = page.inner_text("#coneskin-facts")
        thumb = page.locator("[role=slider]").first  # moves end 1 along, half a millimetre with each key
        thumb.focus()
        for _ in range(4):
            thumb.press("ArrowRight")
        page.wait_for_function("(before) => document.querySelector('#coneskin-facts').innerText !== before", arg=before)
        page.get_by_role("button", name="write").click()
        wait_for_text(page, "#coneskin-told", "written")
        written = tomllib.loads((folder / "sensor.toml").read_text(encoding="utf-8"))
        assert written
        drop(page, other)
        wait_for_text(page, "#coneskin-said", "tube.stl: 1 sheet")
        assert page.url.startswith(server.url), "the browser has not gone to the file"
        page.wait_for_function(DISTANCE + " < 0.3")  # m; the tube is 0.15 m long
        wait_for_text(page, "#coneskin-facts", "infinite")  # r1 of a cylinder
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name="another link").click()
        chooser.value.set_files(other.rename(tmp_path / "pipe.stl"))
        wait_for_text(page, "#coneskin-said", "pipe.stl: 1 sheet")
        assert page.wrong == []
