"""Valid files of every kind, small enough that thousands of them are read in a second."""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from rigs import (
    double_pendulum,
    floating_body,
    four_bar,
    mass_on_cylinder,
    pendulum,
    point,
    point_mass,
    slider_crank,
    tree,
)

SHAPES = (
    '<visual><origin xyz="0 0 0.1" rpy="0 0 1"/><geometry><box size="1 2 3"/></geometry><material name="m"/></visual>'
    '<collision><geometry><cylinder radius="0.1" length="1"/></geometry></collision>'
    '<visual><geometry><mesh filename="package://x/y.stl" scale="1 1 1"/></geometry></visual>'
)
LOAD = '<load name="push" kind="force" point="P" axis="0 0 1" frame="world">{}</load>'
SINES = LOAD.format('<harmonics mean="3" ramp="0.1"><term amplitude="1" frequency="5" phase="0.1"/></harmonics>')
TABLE = LOAD.format('<table file="push.csv" scale="2"/>')
CONTACT = '<contact name="rock" point="P" axis="0 0 1" stiffness="1e5" damping="10" preload="5" mode="unilateral"/>'
HOLD = '<hold name="face" point="P" axes="z"/>'
POSE = '<pose name="up"><joint name="shoulder" position="0.5"/><joint name="elbow" position="0.25"/></pose>'
BENT = '<pose name="bent"><joint name="crank_joint" position="1"/><joint name="slide" position="0.6"/></pose>'
OPENED = (
    '<pose name="open"><joint name="crank_joint" position="0.4"/><joint name="coupler_joint" position="0.3"/>'
    '<joint name="rocker_joint" position="1.2"/></pose>'
)
NUMBERS = '<parameter name="n" value="1" default="1" unit="m" source="assumed: a" text="b"/>'
SPRINGS = (
    '<spring name="s" from="L" to="O" stiffness="300" damping="4" rest_length="0.5"/>'
    '<joint_spring name="j" joint="elbow" stiffness="150" damping="3" rest="0.1"/>'
    '<joint_torque name="t" joint="wrist" value="2"/>'
)

LOAD_TABLE = ("time,force\n" + "".join(f"{i / 100},{math.sin(i):.6f}\n" for i in range(40))).encode()
MEASUREMENT = ("time [s], S_z [mm]\n" + "".join(f"{i / 100},{math.sin(i / 3):.6f}\n" for i in range(60))).encode()


@lru_cache(maxsize=1)
def models() -> tuple[bytes, ...]:
    """Plain URDF files that between them hold every extension element and every kind of joint."""
    texts = (
        mass_on_cylinder(extension=SINES.replace('"P"', '"pin_b"') + NUMBERS),
        double_pendulum(HOLD + POSE + CONTACT),
        slider_crank(extension=BENT),
        four_bar(extension=OPENED),
        floating_body(SINES),
        tree(SPRINGS),
        pendulum(extension=LOAD.format('<constant value="3" ramp="0.1"/>')).replace("</link>", SHAPES + "</link>"),
        point_mass(extension=HOLD.replace('"z"', '"x y" target="0 0"') + CONTACT),
        point_mass(extension=LOAD.format("<table>0,1\n1,2\n2,3\n3,4\n</table>") + point("Q", "world", (1, 2, 3))),
    )
    return tuple(text.encode() for text in texts)


def model_with_table() -> bytes:
    """A model that names a CSV file beside it."""
    return point_mass(extension=TABLE).encode()


XACRO = {
    "rig.urdf.xacro": b"""<?xml version="1.0"?>
<robot name="small" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="P" value="${xacro.load_yaml('numbers.yaml')}"/>
  <xacro:arg name="mass" default="${P['mass']['value']}"/>
  <xacro:arg name="kind" default="${P['kind']['value']}"/>
  <xacro:include filename="part.xacro"/>
  <xacro:property name="length" value="${P['length']['value']}"/>
  <xacro:bar name="bar" mass="$(arg mass)" length="${length}"/>
  <joint name="hinge" type="revolute"><parent link="world"/><child link="bar"/><axis xyz="0 1 0"/>
    <limit lower="${-pi}" upper="${radians(180)}" effort="1" velocity="1"/></joint>
  <link name="world"/>
  <xacro:if value="${xacro.arg('kind') == 'soft'}"><drillrig>
    <point name="P" link="bar" xyz="${length} 0 0"/>
    <joint_spring name="s" joint="hinge" stiffness="${P['stiffness']['value']}" damping="1" rest="initial"/>
    <load name="push" kind="force" point="P" axis="0 0 1" frame="world"><table file="push.csv"/></load>
  </drillrig></xacro:if>
</robot>
""",
    "part.xacro": b"""<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="bar" params="name mass:=1 length **extra"><link name="${name}"><inertial>
    <origin xyz="${length / 2} 0 0"/><mass value="${mass}"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="${mass * length**2 / 12}" iyz="0" izz="${mass * length * length / 12}"/>
  </inertial></link></xacro:macro>
</robot>
""".replace(b" **extra", b""),
    "numbers.yaml": b"""mass: {value: 3.0, unit: kg, source: "assumed: a bar", text: mass of the bar}
length: {value: 0.7, unit: m, source: "paper: table 1", text: length}
stiffness: {value: 2.0e+3, unit: N*m/rad, source: "derived: of both", text: stiffness}
kind: {value: soft, unit: word, source: "assumed: x", text: soft or hard}
""",
    "push.csv": LOAD_TABLE,
}

SCENARIOS = (
    b"""name: case
text: words
model: rig.urdf
pose: up
positions: {shoulder: 0.3}
velocities: {elbow: 0.1}
targets: {face.z: 0.1}
loads: all
duration: 0.01
output_rate: 500
engine: auto
formulation: multipliers
stabilization: {method: baumgarte, alpha: 50, beta: auto, projection: true}
integrator: {method: RK4, step: 1.0e-3}
""",
    b"""duration: 0.005
output_rate: 1000
engine: python
formulation: null_space
loads: []
stabilization: {method: sliding_mode, rate: 100, gain: 0.001, width: 1.0e-5, projection: false}
integrator: {method: DOP853, rtol: 1.0e-6, atol: 1.0e-8, max_step: 0.001}
""",
)

STUDIES = (
    b"""name: study
text: words
model: rig.urdf.xacro
scenario: {duration: 0.01, integrator: {method: RK4}}
set: {scenario.output_rate: 500, model.mass: 2}
axes:
  - {name: scenario.integrator.step, list: [0.001, 0.002]}
  - zip: {scenario.formulation: [multipliers, null_space], scenario.loads: [all, none]}
metrics: ["*.rms", trust.*]
worst: P.z.rms
""",
    b"""model: rig.urdf.xacro
scenario: {duration: 0.01}
axes:
  - {name: model.mass, range: {start: 1, stop: 3, count: 3, scale: log}}
  - latin_hypercube:
      samples: 4
      seed: 3
      bounds: {scenario.duration: [0.1, 0.2], scenario.output_rate: {low: 10, high: 100, scale: log}}
""",
    b"""model: rig.urdf.xacro
scenario: {duration: 0.01}
axes:
  - grid: {model.mass: [1, 2], scenario.output_rate: {start: 100, stop: 200, step: 50}}
  - sobol: {samples: 4, bounds: {scenario.duration: [0.1, 0.2]}}
""",
    b"""model: rig.urdf.xacro
scenario: {duration: 0.01}
axes:
  - holes:
      point: P
      axis: [0, 0, 1]
      direction: [1, 0, 0]
      fixed: []
      places:
        a: {at: [0.5, 0.0, 0.1], pitch: 3, yaw: -2, source: "assumed: x"}
        b: {at: [0.4, 0.0, 0.1]}
""",
)

LIMITS = b"""angle: 1deg
collar: {value: 76, unit: mm, source: "assumed: an example"}
toe_6m: 0.3
toe_9.5m: none
shake: 4 mm
"""

JOURNAL = "\n".join(
    json.dumps(
        {
            "key": key,
            "status": "completed",
            "reason": "",
            "metrics": {"P.z.rms": 1e-3, "trust.energy": 1e-9},
            "units": {"P.z.rms": "m", "trust.energy": "1"},
            "found": {"hinge": 0.1},
            "content_hash": "ab" * 32,
            "solve_time": 0.1,
            "wall_time": 0.2,
        }
    )
    for key in ("{0}", "{1}", "{2}", "{3}")
).encode()


@lru_cache(maxsize=1)
def result() -> bytes:
    """A result file."""
    from drillrig_pin import Scenario, load_rig_text, simulate

    rig = load_rig_text(double_pendulum(HOLD + SINES + CONTACT))
    run = simulate(rig, Scenario(duration=0.05, output_rate=200, engine="python"))
    with TemporaryDirectory() as folder:
        run.save(Path(folder, "run.nc"))
        return Path(folder, "run.nc").read_bytes()
