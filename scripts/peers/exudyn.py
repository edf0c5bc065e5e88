"""The rig in Exudyn: rigid bodies in redundant coordinates, its own joints and hydraulic actuators, symbolic loads.

Pressures are states of an actuator, p' = -+E A x_dot / V(x); integrated exactly that is the logarithmic law. The hold
is a generic joint of the tip on the held world axes. The integrators are implicit and of second order.
"""

from __future__ import annotations

import contextlib
import io
import math
import sys
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from drillrig_pin.elements.loads import HarmonicLaw
from drillrig_pin.kinematics import Anchor, Array
from peers.problem import RATE, Problem, Setting, Stopwatch, divided

sys.exudynFast = True  # type: ignore[attr-defined]  # read at its import: the build without range checks, which says so
with contextlib.redirect_stdout(io.StringIO()):
    import exudyn as exu
    from exudyn import itemInterface as items  # noqa: N813
    from exudyn.advancedUtilities import CreateSymbolicUserFunction
    from exudyn.rigidBodyUtilities import RigidBodyInertia

#: Volume of a hose [m^3]: Exudyn wants some. A nanolitre stiffens no litre of oil, and it is taken off the chamber.
HOSE = 1e-12
#: A modulus beside which the oil is soft: the law knows no other give than the oil's.
RIGID = 1e30
#: Steps per sample and the tolerance of Newton's iteration that the error of such a step deserves.
STEPS = {2: 1e-5, 5: 1e-5, 10: 1e-6, 20: 1e-6, 40: 1e-8, 80: 1e-8, 160: 1e-8}


class Exudyn:
    """A bound rig in Exudyn, from a state of the problem on."""

    name = "Exudyn"
    package = "exudyn"
    orders: ClassVar = {"generalised-alpha": 2, "trapezoidal": 2}

    def __init__(self, problem: Problem, t: float = 0.0, state: tuple[Array, Array] | None = None) -> None:
        exu.config.printToConsole = False
        self.problem, self.t, self.model = problem, t, problem.rig.model
        self.q, self.v = state or (problem.q, problem.v)
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.kept: list[Any] = []  # symbolic functions must live as long as what uses them
        self.data = self.model.createData()
        pin.forwardKinematics(self.model, self.data, self.q, self.v, np.zeros(self.model.nv))
        self.bodies = [self.mbs.AddObject(items.ObjectGround())]
        self.bodies += [self._body(i) for i in range(1, self.model.njoints)]
        self.joints = {i: self._joint(i) for i in range(1, self.model.njoints)}
        self.sensors = [self._sensor(i) for i in self.joints]
        self._add_elements()
        self.mbs.Assemble()

    def _body(self, i: int) -> Any:
        """A free rigid body whose frame is that of its joint."""
        inertia, frame, twist = self.model.inertias[i], self.data.oMi[i], self.data.v[i]
        m, c = inertia.mass, inertia.lever
        about_origin = inertia.inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
        return self.mbs.CreateRigidBody(
            inertia=RigidBodyInertia(m, about_origin, com=c),
            nodeType=exu.NodeType.RotationEulerParameters,
            referencePosition=frame.translation,
            referenceRotationMatrix=frame.rotation,
            initialVelocity=frame.rotation @ twist.linear,
            initialAngularVelocity=frame.rotation @ twist.angular,
            gravity=self.model.gravity.linear,
        )

    def _marker(self, joint: int, placement: Any) -> Any:
        """A frame on a body."""
        return self.mbs.AddMarker(
            items.MarkerBodyRigid(bodyNumber=self.bodies[joint], localHT=np.asarray(placement.homogeneous))
        )

    def _at(self, anchor: Anchor) -> Any:
        """A point on a body."""
        return self._marker(anchor.joint, pin.SE3(np.eye(3), np.array(anchor.vector)))

    def _joint(self, i: int) -> tuple[bool, Any, list[Any]]:
        """Whether joint i slides, its number, its two markers."""
        column = np.asarray(pin.computeJointJacobian(self.model, self.model.createData(), self.q, i))[:, i - 1]
        slides = bool(np.abs(column[:3]).max() > 0.5)
        axis, free = (column[:3], 0) if slides else (column[3:], 2)
        turned = pin.SE3(_frame_with(axis, free), np.zeros(3))
        markers = [
            self._marker(int(self.model.parents[i]), self.model.jointPlacements[i] * turned),
            self._marker(i, turned),
        ]
        kind = items.ObjectJointPrismaticX if slides else items.ObjectJointRevoluteZ
        return slides, self.mbs.AddObject(kind(markerNumbers=markers)), markers

    def _sensor(self, i: int) -> Any:
        slides, joint, _ = self.joints[i]
        what = exu.OutputVariableType.DisplacementLocal if slides else exu.OutputVariableType.Rotation
        sensor = items.SensorObject(objectNumber=joint, outputVariableType=what, storeInternal=True, writeToFile=False)
        return self.mbs.AddSensor(sensor)

    def _add_elements(self) -> None:
        add, problem = self.mbs.AddObject, self.problem
        for line, law in problem.cylinders:
            markers = [self._at(line.start), self._at(line.end)]
            length = float(np.linalg.norm(self._world(line.end) - self._world(line.start)))
            u = length - law.x0
            p = [law.p_A0 - law.E0 * math.log1p(u / law.l_A), law.p_B0 - law.E0 * math.log1p(-u / law.l_B)]
            node = items.NodeGenericODE1(
                referenceCoordinates=[0.0, 0.0], initialCoordinates=p, numberOfODE1Coordinates=2
            )
            add(
                items.ObjectConnectorHydraulicActuatorSimple(
                    markerNumbers=markers,
                    nodeNumbers=[self.mbs.AddNode(node)],
                    offsetLength=law.x0 - law.l_A + HOSE / law.S_A,
                    strokeLength=law.l_A + law.l_B - HOSE / law.S_A - HOSE / law.S_B,
                    chamberCrossSection0=law.S_A,
                    chamberCrossSection1=law.S_B,
                    hoseVolume0=HOSE,
                    hoseVolume1=HOSE,
                    actuatorDamping=law.k,
                    oilBulkModulus=law.E0,
                    cylinderBulkModulus=RIGID,
                    hoseBulkModulus=RIGID,
                    nominalFlow=1.0,  # through valves that are shut
                    useChamberVolumeChange=True,
                )
            )
        for coordinate, spring in problem.springs:
            _, _, markers = self.joints[coordinate.index_v + 1]
            torsion = items.ObjectConnectorTorsionalSpringDamper(
                markerNumbers=markers, stiffness=spring.c, damping=spring.k, offset=spring.x0, torque=-spring.F0
            )
            add(torsion)
        for slide, rock in problem.contacts:
            axis, place = np.array(slide.direction.vector), self._world(slide.point)
            ground = self._marker(0, pin.SE3(np.eye(3), place - (axis @ place - rock.x0) * axis))
            tip = self._at(slide.point)
            spring = items.ObjectConnectorCartesianSpringDamper(
                markerNumbers=[ground, tip], stiffness=rock.c * np.abs(axis), damping=rock.k * np.abs(axis)
            )
            add(spring)
            self.mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=-rock.N0 * axis))
        for loads, kind in ((problem.forces, items.LoadForceVector), (problem.torques, items.LoadTorqueVector)):
            for place, law in loads:
                point = place.point if kind is items.LoadForceVector else Anchor(place.body, (0.0, 0.0, 0.0))
                function = self._symbolic(kind, law, place.direction.vector)
                self.mbs.AddLoad(kind(markerNumber=self._at(point), bodyFixed=True, loadVectorUserFunction=function))
        held = np.array([hold.direction.vector for hold, _ in problem.holds])
        point = problem.holds[0][0].point
        place = self._world(point)
        place += held.T @ (np.array([target for _, target in problem.holds]) - held @ place)
        axes = [int(any(abs(row[k]) > 0.5 for row in held)) for k in range(3)]
        markers = [self._marker(0, pin.SE3(np.eye(3), place)), self._at(point)]
        add(items.ObjectJointGeneric(markerNumbers=markers, constrainedAxes=[*axes, 0, 0, 0]))

    def _world(self, anchor: Anchor) -> Array:
        return np.asarray(self.data.oMi[anchor.joint].act(np.array(anchor.vector)))

    def _symbolic(self, kind: type, law: HarmonicLaw, axis: tuple[float, float, float]) -> Any:
        """The load as an expression that Exudyn evaluates without Python."""
        sin, least = exu.symbolic.sin, exu.symbolic.min
        terms = list(zip(law.amplitude.tolist(), law.frequency.tolist(), law.phase.tolist(), strict=True))

        def load(mbs: Any, t: Any, loadVector: Any) -> Any:
            value = float(law.mean) + sum(A * sin(2 * math.pi * f * t + phase) for A, f, phase in terms)
            s = least(t * (1.0 / float(law.ramp)), 1.0)
            value = s * s * s * (10.0 + s * (6.0 * s - 15.0)) * value
            return exu.symbolic.Vector([float(a) * value for a in axis])

        function = CreateSymbolicUserFunction(
            self.mbs, function=load, userFunctionName="loadVectorUserFunction", itemTypeName=kind.__name__
        )
        self.kept.append(function)
        return function

    def sweep(self) -> list[list[Setting]]:
        """Fixed steps; the trapezoidal rule, of the same order, is never the quicker one."""
        sharpness = zip(divided(*STEPS), STEPS.values(), strict=True)
        return [[Setting("generalised-alpha", step, rtol) for step, rtol in sharpness]]

    def _settings(self, step: float, end: float, rtol: float = 1e-8) -> Any:
        settings = exu.SimulationSettings()
        march = settings.timeIntegration
        march.startTime, march.endTime = self.t, end
        march.numberOfSteps = round((end - self.t) / step)
        march.adaptiveStep = march.automaticStepSize = False
        march.generalizedAlpha.spectralRadius = 0.9
        march.newton.useModifiedNewton = True
        march.newton.relativeTolerance = rtol
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = 1.0 / RATE
        # A hundred unknowns: its dense solver is as quick as the sparse one.
        settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
        return settings

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """One call of its dynamic solver."""
        settings = self._settings(setting.step, float(self.problem.samples[-1]), setting.rtol or 1e-8)
        trapezoidal = exu.DynamicSolverType.TrapezoidalIndex2
        kind = trapezoidal if setting.method == "trapezoidal" else exu.DynamicSolverType.GeneralizedAlpha
        with Stopwatch() as watch:
            self.mbs.SolveDynamic(settings, solverType=kind)
        columns = []
        for sensor, (slides, *_) in zip(self.sensors, self.joints.values(), strict=True):
            columns.append(np.asarray(self.mbs.GetSensorStoredData(sensor))[1:, 1 if slides else 3])
        return watch, np.column_stack(columns)

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """What its solver starts from at a state: accelerations of points of the bodies as those of the joints."""
        other = Exudyn(self.problem, t, (q, v))
        settings, solver = other._settings(1e-6, t + 1e-6), exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(other.mbs, settings)
        model, world = self.model.copy(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        points = [(i, point) for i in self.joints for point in np.eye(3)]  # three tell also how a body turns
        theirs = [
            other.mbs.GetObjectOutputBody(other.bodies[i], exu.OutputVariableType.Acceleration, point)
            for i, point in points
        ]
        solver.FinalizeSolver(other.mbs, settings)
        frames = [
            model.addFrame(pin.Frame(f"{i} {point}", i, 0, pin.SE3(np.eye(3), point), pin.FrameType.OP_FRAME))
            for i, point in points
        ]
        data = model.createData()
        J = [pin.computeFrameJacobian(model, data, q, frame, world)[:3] for frame in frames]
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        drift = [pin.getFrameClassicalAcceleration(model, data, frame, world).linear for frame in frames]
        return np.asarray(np.linalg.lstsq(np.vstack(J), np.concatenate(theirs) - np.concatenate(drift))[0])


def _frame_with(axis: Array, column: int) -> Array:
    """A rotation whose given column is the axis."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    second = np.cross(axis, other)
    second /= np.linalg.norm(second)
    R = np.column_stack([axis, second, np.cross(axis, second)])
    return R if column == 0 else np.roll(R, column, axis=1)
