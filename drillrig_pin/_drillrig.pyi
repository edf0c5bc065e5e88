"""Compiled time loop of drillrig_pin."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


PINOCCHIO_VERSION: str = '4.1.0'

class CompiledTree:
    """A Pinocchio model; immutable, shared by the rigs made of it."""

    def __init__(self, text: str) -> None: ...

class CompiledRig:
    """A rig bound to its equilibrium; immutable, shared by threads."""

    def __init__(self, tree: CompiledTree, joints: Sequence[int], counts: Sequence[int], gears: Sequence[int], ratios: Sequence[float], a: Sequence[float], b: Sequence[float], c: Sequence[float], base: Sequence[int], moving: Sequence[int], constraints: int, kinds: Sequence[int], loads: Sequence[int], parameters: Sequence[float], ranges: Sequence[int], series: Sequence[float], lowest: Sequence[float], highest: Sequence[float], targets: Sequence[float], support: Sequence[int], points: Sequence[float], formulation: int, correction: int, correction_values: Sequence[float], rank: int, rank_threshold: float) -> None: ...

    def evaluate(self, t: float, y: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], law: object | None = None) -> dict:
        """Everything the right-hand side computes at (t, y), by name."""

    def rates(self, times: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], states: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], rates: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], law: object | None = None, beat: object | None = None) -> bool:
        """
        Right-hand sides at times (k) and states (k, size), into rates (k, size); true if one is singular.
        """

    def run(self, y0: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], method: int, step: float, rtol: float, atol: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], relative: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], max_step: float, projection: bool, times: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], ends: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], starts: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], stops: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu')], breaks: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu')], arrays: Sequence[Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')] | None], law: object | None = None, switches: object | None = None, beat: object | None = None) -> tuple:
        """
        Integrate from times[0] to times[-1]; fills a row of the arrays for each; returns (error, status, time, rows, steps, evaluations, switches, last state, further rows).
        """

    def time_rate(self, t: float, y: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], calls: int) -> tuple[float, float]:
        """Nanoseconds per right-hand side, and per crba + rnea alone."""
