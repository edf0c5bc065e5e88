"""The figure of the comparison: time against error, both logarithmic."""

from __future__ import annotations

from pathlib import Path

from peers.race import Point

#: Colour and marker of every engine; the line tells its methods apart.
LOOKS = {
    "core": ("#c0392b", "o"),
    "python": ("#e59866", "v"),
    "mujoco": ("#1f618d", "s"),
    "exudyn": ("#1e8449", "D"),
    "scipy": ("#7d3c98", "^"),
    "drake": ("#566573", "P"),
}
LINES = ("-", "--", ":", "-.")


def draw(points: list[Point], path: Path) -> None:
    """Write the figure as PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8.0, 6.4), constrained_layout=True)
    seen: dict[str, list[str]] = {}
    groups: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        groups.setdefault((point.key, point.setting.method), []).append(point)
    for (key, method), members in groups.items():
        colour, marker = LOOKS[key]
        line = LINES[len(seen.setdefault(key, []))]
        seen[key].append(method)
        members = sorted(members, key=lambda p: p.error)
        axes.loglog(
            [1e3 * p.least for p in members],
            [p.error for p in members],
            line,
            marker=marker,
            markersize=4.5,
            color=colour,
            markerfacecolor=colour if line == "-" else "white",
            label=f"{members[0].engine}: {method}",
        )
    axes.set_ylim(1e-10, 3e-4)
    axes.set_xlabel("time for 2 s of drilling on an idle machine [ms]")
    axes.set_ylabel("largest error of a joint [rad, m]")
    axes.set_title("MK-Z49, hole no. 9: work and precision of several engines, one thread")
    axes.grid(True, which="major", color="0.88")
    figure.legend(
        *axes.get_legend_handles_labels(),
        frameon=False,
        fontsize=8,
        loc="outside lower center",
        ncols=3,
        handlelength=4,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)
