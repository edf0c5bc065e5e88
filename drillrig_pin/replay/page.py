"""One run, or several, as one HTML document that needs nothing else: no server, no network."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

from drillrig_pin.escaping import script_json
from drillrig_pin.replay.payload import scene_bytes, scene_words
from drillrig_pin.scene.options import ReplayOptions
from drillrig_pin.scene.scene import Scene, build_scene
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.words import plain

#: In one scope, in this order.
SCRIPTS = ("payload.js", "film.js", "player.js")


def animation_page(
    trajectories: Sequence[Trajectory], options: ReplayOptions | None = None, names: Sequence[str] = ()
) -> str:
    """A self-contained page with the animation of runs, Meshcat's viewer included.

    Args:
        trajectories: the first is drawn in full, the others as ghosts or, if the options say so, beside it.
        options: what is shown; None: the defaults.
        names: of the runs, for title and legend; empty: those of their scenarios.

    Raises:
        ResultFileError: a run of fewer than two samples.
        ModelError: the model a run carries cannot be read.
    """
    return static_page(build_scene(trajectories, options, names))


def static_page(scene: Scene) -> str:
    """A scene as a self-contained page."""
    packed = gzip.compress(scene_bytes(scene), 6, mtime=0)
    return _rendered(
        title=scene.title,
        viewer=viewer_script(),
        words=script_json(plain(scene_words(scene))),
        bytes=base64.b64encode(packed).decode(),
    )


def live_page(title: str) -> str:
    """The same page for a server that hands out viewer and scene."""
    return _rendered(title=title)


def viewer_script() -> str:
    """Meshcat's viewer, as its package ships it, safe to stand inside a page."""
    text = files("meshcat").joinpath("viewer", "dist", "main.min.js").read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script")


def _rendered(title: str, **blocks: Any) -> str:
    from jinja2 import Environment

    def text(name: str) -> str:
        return files("drillrig_pin.replay").joinpath("assets", name).read_text(encoding="utf-8")

    # The title is escaped; the blocks are scripts and data made here, which escaping would break.
    template = Environment(autoescape=False).from_string(text("page.html"))
    player = "\n".join(map(text, SCRIPTS))
    return template.render(title=escape(title), style=text("page.css"), player=player, **blocks)
