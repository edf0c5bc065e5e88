"""No attribute and no element of a URDF file is dropped without a word: each is altered, and something must change."""

from __future__ import annotations

import pytest
from rigs import mass_on_cylinder, pendulum, point_mass, slider_crank
from robots import robot_text
from test_urdf_reading import BOOM
from urdf_mutation import unnoticed

from drillrig_pin.model.modelfile import read_model

#: Text of a file, and of how many kinds of changes one is tried: all for small files.
FILES = {
    "boom": (lambda: BOOM, 1),
    "pendulum": (pendulum, 1),
    "mass on cylinder": (mass_on_cylinder, 1),
    "slider-crank": (slider_crank, 1),
    "point mass": (point_mass, 1),
    "mkz49": (lambda: read_model("mkz49").text, 12),
    "ur5": (lambda: robot_text("ur5_robot.urdf"), 3),
    "double pendulum": (lambda: robot_text("double_pendulum.urdf"), 3),
    "solo12": (lambda: robot_text("solo12.urdf"), 3),
    "finger": (lambda: robot_text("finger_edu.urdf"), 3),
}


@pytest.mark.parametrize("name", FILES)
def test_nothing_is_dropped_without_a_word(name: str) -> None:
    make, share = FILES[name]
    assert unnoticed(make(), every=False, share=share) == []
