"""A scene as the page takes it: objects and motion in one block of bytes, words in one JSON document."""

from __future__ import annotations

from typing import Any

from drillrig_pin.replay.keyframes import packed
from drillrig_pin.replay.objects import commands
from drillrig_pin.scene.scene import Scene


def scene_bytes(scene: Scene) -> bytes:
    """Number of blocks, then blocks with their lengths first (4 bytes, little endian): the motion, then commands."""
    blocks = [packed(scene.parts, scene.frames), *commands(scene.parts)]
    sized = (len(block).to_bytes(4, "little") + block for block in blocks)
    return len(blocks).to_bytes(4, "little") + b"".join(sized)


def scene_words(scene: Scene) -> dict[str, Any]:
    """Everything that is written, and what the page needs to know to place the camera."""
    return {
        "title": scene.title,
        "sentences": scene.sentences,
        "keys": [{"mark": key.mark, "colours": list(key.colours), "text": key.text} for key in scene.keys],
        "notes": scene.notes,
        "speed": scene.speed,
        "fastest": scene.fastest,
        "start": float(scene.frames[0]),
        "end": float(scene.frames[-1]),
        "step": float(scene.frames[1] - scene.frames[0]),
        "tail": scene.tail,
        "grid": scene.grid,
        "size": scene.size,
        "view": scene.view,
        "views": {
            name: {"direction": view.toward_camera, "low": view.low, "high": view.high}
            for name, view in scene.views.items()
        },
        "roots": sorted({part.path[0] for part in scene.parts}),
    }
