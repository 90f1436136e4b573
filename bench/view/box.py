"""Page of viser's with a box that moves, 30 times a second, for bench `view`: the least that a picture can take."""

from __future__ import annotations

import math
import os
import time

from coneskin.view.page_server import PageServer

MOVE_PERIOD = 1.0 / 30.0  # s between two places of the box


def main() -> None:
    """Serve the page until this process is ended, and print its address."""
    os.nice(10)  # as the page beside a guard
    with PageServer("box", port=18400) as server:
        server.scene.configure_environment_map(hdri=None)
        server.scene.configure_default_lights(enabled=False)
        server.scene.add_light_directional("/sun", position=(1.0, 1.0, 1.0), cast_shadow=False)
        box = server.scene.add_box("/box", cast_shadow=False, receive_shadow=False)
        print(server.url, flush=True)
        while True:
            box.position = (0.0, math.sin(time.monotonic()), 0.0)
            time.sleep(MOVE_PERIOD)


if __name__ == "__main__":
    main()
