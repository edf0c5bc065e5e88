"""Which moments of a run are drawn: speed, frames, and samples averaged over what a frame lasts."""

from __future__ import annotations

import numpy as np

from drillrig_pin.analysis.motion import survey_point
from drillrig_pin.analysis.spectra import amplitude_spectrum, strongest_lines
from drillrig_pin.errors import ResultFileError
from drillrig_pin.kinematics import Array
from drillrig_pin.scene.options import MAX_FRAMES, ReplayOptions, round_down
from drillrig_pin.trajectory import AXES, Trajectory

#: A vibration that shows at most this often a second can be followed by eye [Hz].
READABLE = 2.5


def fastest_line(trajectory: Trajectory, steady: slice) -> float:
    """Highest frequency among the strongest lines of the survey point [Hz], or of the joints; 0 without any."""
    point = survey_point(trajectory)
    if point is not None:
        signals, names = trajectory.of("point_displacement", point)[steady], list(AXES)
    else:
        signals, names = trajectory.q[steady], trajectory.labels["joint"]
    with np.errstate(all="ignore"):
        spectrum = amplitude_spectrum(trajectory.time[steady], signals)
    if spectrum is None or not np.isfinite(spectrum.amplitude).all():
        return 0.0
    return max((line.frequency for line in strongest_lines(spectrum, names)), default=0.0)


def chosen_speed(fastest: float, options: ReplayOptions) -> float:
    """The speed asked for; ``auto``: real time, or slower until the fastest vibration can be followed by eye."""
    if options.speed != "auto":
        return float(options.speed)
    return 1.0 if fastest <= READABLE else round_down(READABLE / fastest)


def usable(trajectory: Trajectory, options: ReplayOptions) -> slice:
    """The samples shown: those between start and end that are finite.

    Raises:
        ResultFileError: fewer than two of them.
    """
    time = trajectory.time
    finite = np.isfinite(trajectory.q).all(axis=1) & (np.abs(trajectory.q).max(axis=1, initial=0.0) < 1e6)
    count = len(time) if finite.all() else int(np.argmin(finite))
    first = 0 if options.start is None else int(np.searchsorted(time, options.start - 1e-12))
    last = count if options.end is None else min(count, int(np.searchsorted(time, options.end + 1e-12)))
    if last - first < 2:
        if count < 2:
            why = f"There is nothing to replay. The run ended: {trajectory.outcome}"
            raise ResultFileError("the run holds fewer than two samples", todo=why)
        raise ResultFileError(
            f"fewer than two samples lie in the part asked for; the run goes from {time[0]:g} to {time[count - 1]:g} s",
            todo="Change --from and --to.",
        )
    return slice(first, last)


def frame_times(time: Array, rate: float) -> Array:
    """Equally spaced times over a stretch of samples, at most ``rate`` a second and no denser than the samples."""
    span = float(time[-1] - time[0])
    samples = len(time) - 1
    count = int(np.clip(np.ceil(span * rate - 1e-6), 1, min(samples, MAX_FRAMES)))
    return np.linspace(time[0], time[-1], count + 1)


def resampled(time: Array, values: Array, frames: Array) -> Array:
    """Values (n, ...) at the times of the frames.

    Where frames are farther apart than samples, a frame shows the mean over the time it lasts, as a camera does:
    single samples would turn a fast vibration into a slow one that is not there.
    """
    columns = values.reshape(len(time), -1)
    step = float(frames[1] - frames[0])
    found = np.empty((len(frames), columns.shape[1]))
    if step < 1.5 * float(time[-1] - time[0]) / (len(time) - 1):
        for k in range(columns.shape[1]):
            found[:, k] = np.interp(frames, time, columns[:, k])
    else:
        area = np.zeros_like(columns)
        np.cumsum(0.5 * (columns[1:] + columns[:-1]) * np.diff(time)[:, None], axis=0, out=area[1:])
        left, right = np.maximum(frames - step / 2, time[0]), np.minimum(frames + step / 2, time[-1])
        for k in range(columns.shape[1]):
            found[:, k] = (np.interp(right, time, area[:, k]) - np.interp(left, time, area[:, k])) / (right - left)
    return np.asarray(found.reshape(len(frames), *values.shape[1:]))
